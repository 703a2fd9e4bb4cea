//! What robots tell each other: ALLIANCE broadcasts (ALLIANCE.md §3 "Messages", thesis §3.3.4 and §4.2.3).

use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::allocation::AllocationMessage;
use crate::ids::{BehaviorId, Incarnation, RobotId, TaskId, Tick};
use crate::mission::items::ItemsBulletin;
use crate::mission::{Lore, Payload};
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
    /// What the mission tells at once, beside what heartbeats repeat.
    Bulletin(Bulletin),
    /// What the sender's allocator says.
    Allocation(AllocationMessage),
}

/// The kinds of broadcast; each has its own key below `team/<robot>/`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
pub enum BroadcastKind {
    /// [`Content::Heartbeat`].
    Heartbeat,
    /// [`Content::Bulletin`] of the [first](BulletinKind::First) kind.
    FirstBulletin,
    /// [`Content::Bulletin`] of the [second](BulletinKind::Second) kind.
    SecondBulletin,
    /// [`Content::Allocation`].
    Allocation,
}

impl BroadcastKind {
    /// All kinds, in the order of their declaration.
    pub const ALL: [Self; 4] = [
        Self::Heartbeat,
        Self::FirstBulletin,
        Self::SecondBulletin,
        Self::Allocation,
    ];

    /// Last chunk of the key expression, and the `kind` column of messages.csv, where the mission's bulletins have
    /// [these names](crate::mission::data::Terms::bulletins).
    #[must_use]
    pub fn name(self, bulletins: [&'static str; 2]) -> &'static str {
        match self {
            Self::Heartbeat => "heartbeat",
            Self::FirstBulletin => bulletins[0],
            Self::SecondBulletin => bulletins[1],
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
            Self::Bulletin(bulletin) => match bulletin.kind {
                BulletinKind::First => BroadcastKind::FirstBulletin,
                BulletinKind::Second => BroadcastKind::SecondBulletin,
            },
            Self::Allocation(_) => BroadcastKind::Allocation,
        }
    }
}

/// A broadcast of the mission's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bulletin {
    /// Which of the mission's kinds it is.
    pub kind: BulletinKind,
    /// The task that it counts as a message about; `None`: about none.
    pub about: Option<About>,
    /// What it says.
    pub payload: Payload,
}

impl ItemsBulletin {
    /// As it is broadcast.
    #[must_use]
    pub fn about(self, about: Option<About>) -> Bulletin {
        Bulletin {
            kind: match self {
                Self::PositionUpdate(_) => BulletinKind::First,
                Self::Withdrawal(_) => BulletinKind::Second,
            },
            about,
            payload: Payload::Items(self),
        }
    }
}

/// The kinds of bulletins that a mission may have. There are two at most: the draws of a link number all kinds of broadcasts, and heartbeats and allocation come beside them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)] // What they are for is the mission's.
pub enum BulletinKind {
    First,
    Second,
}

/// What a bulletin is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// The task.
    pub task: TaskId,
    /// The sender's behavior set for it.
    pub set: BehaviorId,
    /// The sender's progress count on it.
    pub progress: u32,
}

/// What a robot does about a task, as its heartbeats say it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
    pub lore: Lore,
}
