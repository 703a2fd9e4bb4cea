//! What robots tell each other: ALLIANCE broadcasts (ALLIANCE.md §3 "Messages", thesis §3.3.4 and §4.2.3).

use glam::Vec2;
use serde::{Deserialize, Serialize};

use crate::allocation::AllocationMessage;
use crate::ids::{BehaviorId, Incarnation, RobotId, TaskId, Tick};
use crate::time::SimTime;

/// A message from one robot to all others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Broadcast {
    /// Who sends it.
    pub sender: RobotId,
    /// The sender's incarnation.
    pub incarnation: Incarnation,
    /// Tick in which it was sent.
    pub tick: Tick,
    /// Place among the sender's broadcasts of that tick, from 0.
    pub index: u16,
    /// Running number within the incarnation, from 0.
    pub seq: u64,
    /// Simulated time of sending.
    pub sent: SimTime,
    /// What it says.
    pub body: Content,
}

/// Contents of a broadcast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Content {
    /// "I am here and this is what I do."
    Heartbeat(Heartbeat),
    /// "I have found the locations" (thesis §4.2.3); counts as a message about `task`.
    PositionUpdate {
        /// The task that found them.
        task: TaskId,
        /// Behavior set that found them.
        set: BehaviorId,
        /// The finder's progress count on that task.
        progress: u32,
        /// What was found.
        locations: Fact<Locations>,
    },
    /// "These locations are wrong": takes back the update of that finder and time.
    Withdrawal(Withdrawal),
    /// What the sender's allocator says.
    Allocation(AllocationMessage),
}

/// The kinds of broadcast; each has its own key below `team/<robot>/`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum BroadcastKind {
    /// [`Content::Heartbeat`].
    Heartbeat,
    /// [`Content::PositionUpdate`].
    Position,
    /// [`Content::Withdrawal`].
    Withdrawal,
    /// [`Content::Allocation`].
    Allocation,
}

impl BroadcastKind {
    /// All kinds, in the order of their declaration.
    pub const ALL: [Self; 4] = [
        Self::Heartbeat,
        Self::Position,
        Self::Withdrawal,
        Self::Allocation,
    ];

    /// Last chunk of the key expression, and the `kind` column of messages.csv.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Heartbeat => "heartbeat",
            Self::Position => "position",
            Self::Withdrawal => "withdrawal",
            Self::Allocation => "allocation",
        }
    }
}

impl Content {
    /// The kind of this message.
    #[must_use]
    pub fn kind(&self) -> BroadcastKind {
        match self {
            Self::Heartbeat(_) => BroadcastKind::Heartbeat,
            Self::PositionUpdate { .. } => BroadcastKind::Position,
            Self::Withdrawal(_) => BroadcastKind::Withdrawal,
            Self::Allocation(_) => BroadcastKind::Allocation,
        }
    }
}

/// What a robot does about a task, as its heartbeats say it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TaskState {
    /// Its behavior set for the task is active.
    Executing,
    /// Its behavior set is at the threshold and waits for a teammate to leave the task.
    Waiting,
    /// It does nothing; idle is not dead.
    Idle,
    /// It has just left the task.
    Released,
}

impl TaskState {
    /// The `state` column of messages.csv.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Executing => "executing",
            Self::Waiting => "waiting",
            Self::Idle => "idle",
            Self::Released => "released",
        }
    }
}

/// A heartbeat: sent at once on a change of state or progress, and every 1/ρ after that.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// What the sender does.
    pub state: TaskState,
    /// Since when it has been in that state.
    pub since: SimTime,
    /// The behavior set; `None` when idle.
    pub set: Option<BehaviorId>,
    /// Its task; `None` when idle.
    pub task: Option<TaskId>,
    /// Effects on the world that the sender has achieved on the task so far (ALLIANCE.md §3 "Progress").
    pub progress: u32,
    /// Where the sender believes to be, m.
    pub position: Option<Vec2>,
    /// Whether it carries an item.
    pub carrying: bool,
    /// What it knows about the mission.
    pub knowledge: Knowledge,
}

/// Something somebody saw. The newest wins; own sight beats hearsay (DESIGN §7).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact<T> {
    /// What was seen.
    pub value: T,
    /// Who saw it.
    pub seen_by: RobotId,
    /// When.
    pub seen: SimTime,
}

/// Where things are, as computed from the border's extremes (thesis §4.1.1.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Locations {
    /// Smallest x and y of the border, m.
    pub min: Vec2,
    /// Largest x and y of the border, m.
    pub max: Vec2,
}

/// Takes back the [`Locations`] that `finder` broadcast as seen at `seen`, and its older ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Withdrawal {
    /// Whose update is withdrawn.
    pub finder: RobotId,
    /// The time of that update.
    pub seen: SimTime,
}

/// Waste lying, or no longer lying, outside the spills.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LooseWaste {
    /// Where, m.
    pub at: Vec2,
    /// Whether something lies there; `false` once a robot has looked and found nothing.
    pub present: bool,
}

/// A robot's knowledge about the waste clean-up, repeated in every heartbeat, so that lost messages, added waste and
/// newcomers are no special case (DESIGN §7).
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Knowledge {
    /// The locations, once found.
    pub locations: Option<Fact<Locations>>,
    /// Latest withdrawal known of each finder, by rank of the finder.
    pub withdrawn: Vec<Withdrawal>,
    /// By spill, by its place in the scenario and in that order, as far as known: `true` = seen empty, `false` = waste seen
    /// there.
    pub empty: Vec<(u16, Fact<bool>)>,
    /// Places outside the spills with waste, or searched since.
    pub loose: Vec<Fact<LooseWaste>>,
    /// Latest progress report known.
    pub last_report: Option<Fact<()>>,
}

/// By hand: `clone_from` reuses the buffers of the old value, so a heartbeat does not allocate.
impl Clone for Knowledge {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, source: &Self) {
        let Self {
            locations,
            withdrawn,
            empty,
            loose,
            last_report,
        } = source;
        self.locations = *locations;
        self.withdrawn.clone_from(withdrawn);
        self.empty.clone_from(empty);
        self.loose.clone_from(loose);
        self.last_report = *last_report;
    }
}
