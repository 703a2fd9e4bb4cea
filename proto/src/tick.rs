//! The lockstep of world and agents (DESIGN §4).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ids::{BehaviorId, Incarnation, RobotId, TaskId, Tick};
use crate::link::LinkState;
use crate::readings::{Actuation, Readings};
use crate::telemetry::{AllocationRow, Motivation, Note, Reception, StateChange};
use crate::time::SimTime;

/// World → one agent: sense, hear, think and act for this tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickMessage {
    /// The incarnation it is addressed to; any other that reads it has been superseded and must end.
    pub incarnation: Incarnation,
    /// Number of the tick.
    pub tick: Tick,
    /// Its simulated time.
    pub now: SimTime,
    /// Latest tick in which a report of this incarnation counted. What the agent did after it never happened.
    pub last_counted: Option<Tick>,
    /// The broadcasts that count since this agent's last step, by (sender, tick).
    pub manifest: Vec<ManifestEntry>,
    /// Senders whose messages are held back in this tick; held ones of all others are let go. By rank.
    pub held: Vec<RobotId>,
    /// What the robot senses.
    pub readings: Readings,
    /// What no robot could know: the offers of the tick before, by robot, of all that share tasks with it, directly or through others;
    /// empty where the robot's allocator does not ask for them.
    /// [`ToAgent::Informed`] brings it.
    #[serde(skip)]
    pub truth: Vec<Offer>,
}

/// What a unit of a task is worth if that robot does it. Only of robots that can work, and of tasks on which there is something to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Offer {
    /// The robot.
    pub robot: RobotId,
    /// The behavior with which it would do it.
    pub behavior: BehaviorId,
    /// The task.
    pub task: TaskId,
    /// Utility, above 0, as the robot's own allocator has it.
    pub utility: f64,
}

/// "These broadcasts of that sender and tick count: wait for them."
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ManifestEntry {
    /// Who sent them.
    pub sender: RobotId,
    /// In which tick.
    pub tick: Tick,
    /// In which incarnation.
    pub incarnation: Incarnation,
    /// How many: their indices run from 0 to `count - 1`.
    pub count: u16,
    /// State of the link from the sender to this receiver; `None` is an undisturbed one, as most are. The
    /// others are boxed to keep entries small.
    pub link: Option<Box<LinkState>>,
}

/// What the world publishes on an agent's tick key. Who sends it may keep the tick and lend it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToAgent<T = Box<TickMessage>> {
    /// The next tick.
    Tick(T),
    /// The run is over; the agent ends.
    End(Outcome),
    /// This incarnation has been superseded or given up; the agent that has it ends.
    Dismissed(Incarnation),
    /// The next tick, and its [truth](TickMessage::truth) if there is any.
    Informed(T, Vec<Offer>),
}

/// Agent → world: what it did in a tick. Published after the tick's broadcasts, on the same session.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Whose report it is.
    pub robot: RobotId,
    /// In which incarnation.
    pub incarnation: Incarnation,
    /// Tick it answers.
    pub tick: Tick,
    /// What the body shall do.
    pub actuation: Actuation,
    /// How many broadcasts were published in this tick.
    pub broadcasts: u16,
    /// Their payloads together, bytes: encoded and sealed.
    pub broadcast_bytes: u32,
    /// The behavior that is active at the end of the step.
    pub active: Option<BehaviorId>,
    /// Motivations of all behaviors, in the order of the catalog, of allocators that have them.
    pub motivations: Vec<Motivation>,
    /// What the robot's allocator holds of tasks, of all other allocators.
    pub allocation: Vec<AllocationRow>,
    /// Changes of state in this step, in the order in which they happened.
    pub changes: Vec<StateChange>,
    /// Other things worth a line in the log.
    pub notes: Vec<Note>,
    /// The delivery of each broadcast of the manifest, by (sender, tick, index).
    pub receptions: Vec<Reception>,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// All is done.
    Complete,
    /// The time limit passed first.
    TimeLimit,
    /// Somebody asked it to end.
    Interrupted,
    /// No robot is left that could do anything.
    NoRobotLeft,
}

impl Outcome {
    /// As written to run.json and shown to people.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::TimeLimit => "time-limit",
            Self::Interrupted => "interrupted",
            Self::NoRobotLeft => "no-robot-left",
        }
    }
}
