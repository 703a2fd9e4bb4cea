//! The messages of the lockstep between world and agents.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::link::LinkState;
use crate::readings::{Actuation, Readings};
use crate::team::{BroadcastKey, EncodedBroadcast};
use crate::telemetry::{AllocationRow, Motivation, Note, Reception, StateChange};
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId, Tick};
use scenario::time::SimTime;

/// World → one agent: a tick with its readings and the list of broadcasts to receive.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickMessage {
    /// The addressed incarnation. An agent with another incarnation has been superseded and must end.
    pub incarnation: Incarnation,
    pub tick: Tick,
    pub now: SimTime,
    /// The last tick in which a report of this incarnation counted. The agent must undo all later steps.
    pub last_counted: Option<Tick>,
    /// The broadcasts that count since this agent's last step, by (sender, tick).
    pub manifest: Vec<ManifestEntry>,
    /// The senders whose messages are held back in this tick, by rank. Held messages of all other senders are released.
    pub held: Vec<RobotId>,
    pub readings: Readings,
    /// Ground truth that robots cannot measure: the offers of the previous tick, by robot. They cover all robots that
    /// share tasks with this robot, directly or through others. The list is empty unless the robot's allocator requests
    /// it. [`ToAgent::Tick`] transmits it.
    #[serde(skip)]
    pub ground_truth: Vec<TaskOffer>,
}

/// The value of one unit of a task for a robot. Offers exist only for robots that can work, and for tasks with open
/// work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskOffer {
    pub robot: RobotId,
    pub behavior: BehaviorId,
    pub task: TaskId,
    /// The utility according to the robot's own allocator, above 0.
    pub utility: f64,
}

/// The broadcasts of a sender and tick that count.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ManifestEntry {
    pub sender: RobotId,
    pub tick: Tick,
    pub incarnation: Incarnation,
    /// The number of broadcasts. Their indices run from 0 to `count - 1`.
    pub count: u16,
    /// The state of the link from the sender to this receiver; `None` for an undisturbed link. The box keeps entries
    /// small, since most links are undisturbed.
    pub link: Option<Box<LinkState>>,
}

impl ManifestEntry {
    /// Returns the keys of the broadcasts, by index.
    pub fn keys(&self) -> impl Iterator<Item = BroadcastKey> + use<> {
        let (tick, sender, incarnation) = (self.tick, self.sender, self.incarnation);
        (0..self.count).map(move |index| (tick, sender, incarnation, index))
    }
}

/// The size limit of a message on an agent's tick key, bytes. It contains the broadcasts of a whole team, and with its seal
/// it is within the largest message of a session.
pub const TICK_LIMIT_BYTES: usize = 1_000_000;

/// The contents of a message on an agent's tick key. With a borrowed `T` the sender keeps the tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToAgent<T = Box<TickMessage>, B = EncodedBroadcast> {
    /// The agent answers with a [`Report`].
    Tick {
        tick: T,
        /// The tick's [ground truth](TickMessage::ground_truth).
        ground_truth: Vec<TaskOffer>,
        /// The broadcasts of the manifest by (sender, tick, index); `None` for one that did not reach the world, or for
        /// which the message has no room.
        broadcasts: Vec<Option<B>>,
    },
    End(Outcome),
    /// The incarnation has been superseded or given up, and its agent ends.
    Dismissed(Incarnation),
}

/// Agent → world: the result of a tick. The agent publishes it after the tick's broadcasts, on the same session, so that
/// these reach the world before it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub robot: RobotId,
    pub incarnation: Incarnation,
    pub tick: Tick,
    pub actuation: Actuation,
    pub broadcasts: u16,
    /// The total payload of the tick's broadcasts, bytes, encoded and sealed.
    pub broadcast_bytes: u32,
    /// The behavior that is active at the end of the step.
    pub active: Option<BehaviorId>,
    /// The motivations of all behaviors, in the order of the catalog. Empty for allocators without motivations.
    pub motivations: Vec<Motivation>,
    /// The rows of an allocator without motivations, one per behavior.
    pub allocation: Vec<AllocationRow>,
    /// The changes of state in this step, in chronological order.
    pub changes: Vec<StateChange>,
    pub notes: Vec<Note>,
    /// The delivery of each broadcast of the manifest, by (sender, tick, index).
    pub receptions: Vec<Reception>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    Complete,
    TimeLimit,
    /// An operator or a signal ended the run.
    Interrupted,
    /// No robot is left that can continue the mission.
    NoRobotLeft,
    /// No work is left, but some of it expired before it was done.
    Expired,
}

impl Outcome {
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::TimeLimit => "time-limit",
            Self::Interrupted => "interrupted",
            Self::NoRobotLeft => "no-robot-left",
            Self::Expired => "expired",
        }
    }
}
