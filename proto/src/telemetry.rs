//! What an agent tells the world for the log: its motivations with their factors, why its states changed, and the delivery of
//! every message.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use crate::team::{BroadcastKind, TaskState};
use crate::time::SimTime;

/// State of a behavior set (thesis §3.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum BehaviorState {
    /// Below the threshold, or suppressed.
    #[default]
    Hibernating,
    /// At the threshold while a teammate executes the exclusive task.
    Waiting,
    /// Executing.
    Active,
}

impl BehaviorState {
    /// The `state` column of motivations.csv.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Hibernating => "hibernating",
            Self::Waiting => "waiting",
            Self::Active => "active",
        }
    }
}

/// One row of motivations.csv: a motivational behavior at the end of a step, with the factors of eq. 2.7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Motivation {
    /// The behavior set.
    pub set: BehaviorId,
    /// m, in [0, θ].
    pub motivation: f64,
    /// Rate of this step, motivation/s (eq. 2.4).
    pub impatience: f64,
    /// Factor (eq. 2.1).
    pub sensory_feedback: bool,
    /// Factor (eq. 2.3); `false` = another set of the robot is active.
    pub activity_suppression: bool,
    /// Factor (eq. 2.5); `false` = reset in this step.
    pub impatience_reset: bool,
    /// Factor (eq. 2.6); `false` = yields or gives up.
    pub acquiescence: bool,
    /// State at the end of the step.
    pub state: BehaviorState,
}

/// Why the state of a behavior set changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    /// The motivation reached θ.
    Threshold,
    /// sensory_feedback became 0.
    NotApplicable,
    /// Another set of the robot is active.
    Suppressed,
    /// impatience_reset by the first message of this teammate.
    ResetBy(RobotId),
    /// Active longer than ψ and a teammate wants the task.
    AcquiescedPsi,
    /// Active longer than λ.
    GaveUpLambda,
    /// Lost against an earlier or lower-ranked claim to the same exclusive task.
    Arbitration,
    /// Waited, and nobody executes the task any more.
    WaitOver,
    /// Waited its own ψ + τ in vain: the incumbent may be deaf or babbling.
    WaitBound,
    /// The allocator prefers it.
    Chosen,
    /// The allocator prefers another.
    Reassigned,
    /// Nobody was known to have the task.
    Claimed,
    /// A teammate's claim or bid is better.
    Outbid,
    /// An auction was won.
    Awarded,
    /// A contract was not renewed in time.
    LeaseEnded,
    /// Whoever watches it saw no progress.
    NoProgress,
    /// Chance chose it.
    Drawn,
}

impl Reason {
    /// The `reason` column of events.csv, with teammates by name.
    #[must_use]
    pub fn describe<'a>(self, name: impl Fn(RobotId) -> &'a str) -> String {
        match self {
            Self::Threshold => "threshold".into(),
            Self::NotApplicable => "not-applicable".into(),
            Self::Suppressed => "suppressed".into(),
            Self::ResetBy(robot) => format!("reset-by {}", name(robot)),
            Self::AcquiescedPsi => "acquiesced-psi".into(),
            Self::GaveUpLambda => "gave-up-lambda".into(),
            Self::Arbitration => "arbitration".into(),
            Self::WaitOver => "wait-over".into(),
            Self::WaitBound => "wait-bound".into(),
            Self::Chosen => "chosen".into(),
            Self::Reassigned => "reassigned".into(),
            Self::Claimed => "claimed".into(),
            Self::Outbid => "outbid".into(),
            Self::Awarded => "awarded".into(),
            Self::LeaseEnded => "lease-ended".into(),
            Self::NoProgress => "no-progress".into(),
            Self::Drawn => "drawn".into(),
        }
    }
}

/// A change of state in one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StateChange {
    /// The behavior set.
    pub set: BehaviorId,
    /// Before.
    pub from: BehaviorState,
    /// After.
    pub to: BehaviorState,
    /// Why.
    pub reason: Reason,
}

/// What became of a broadcast at one receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Delivery {
    /// Heard in the step after it was sent.
    Heard,
    /// Listed by the world but never arrived: a real loss.
    Lost,
    /// Heard later, for a fault of the link delayed it, held it back or had it overtaken.
    Delayed,
    /// A second copy, ignored.
    Duplicate,
    /// Lost by a fault of the link.
    Dropped,
    /// Cut off: mute, deaf, partition, out of range, or due when the receiver took no part.
    Cut,
    /// On its way: [`Delivery::Delayed`] or [`Delivery::Cut`] will follow, unless the receiver or the run ends first.
    Pending,
}

impl Delivery {
    /// The `delivery` column of messages.csv.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Heard => "heard",
            Self::Lost => "lost",
            Self::Delayed => "delayed",
            Self::Duplicate => "duplicate",
            Self::Dropped => "dropped",
            Self::Cut => "cut",
            Self::Pending => "pending",
        }
    }
}

/// One row of messages.csv: a broadcast at one receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Reception {
    /// When it was, or would have been, audible.
    pub at: SimTime,
    /// Who sent it.
    pub sender: RobotId,
    /// In which incarnation.
    pub incarnation: Incarnation,
    /// When it was sent.
    pub sent: SimTime,
    /// What became of it.
    pub delivery: Delivery,
    /// What it said; `None` when it never arrived.
    pub said: Option<Said>,
}

/// The logged part of a broadcast's contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Said {
    /// Running number within the incarnation.
    pub seq: u64,
    /// Its kind.
    pub kind: BroadcastKind,
    /// State it claims; heartbeats only.
    pub state: Option<TaskState>,
    /// Since when; heartbeats only.
    pub since: Option<SimTime>,
    /// Behavior set it is about.
    pub set: Option<BehaviorId>,
    /// Task it is about.
    pub task: Option<TaskId>,
    /// Progress count it claims.
    pub progress: Option<u32>,
}

/// Something an agent decided or learned that the log should say, beside state changes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note {
    /// The `kind` column of events.csv.
    pub kind: NoteKind,
    /// The `detail` column.
    pub detail: String,
}

/// Kinds of [`Note`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "u32", into = "u32")]
pub enum NoteKind {
    /// An effect on the world (ALLIANCE.md §3 "Progress").
    Progress,
    /// Goes round an obstacle (memory of the detour in the detail).
    Detour,
    /// One of the mission's own, by its place among those that the mission declares.
    Mission(u8),
}

impl NoteKind {
    /// The numbers of the common ones on the bus; the mission's have those below and above.
    const PROGRESS: u32 = 5;
    const DETOUR: u32 = 6;

    /// The `kind` column of events.csv; `own` are those that the mission declares.
    #[must_use]
    pub fn as_str(self, own: &'static [&'static str]) -> &'static str {
        match self {
            Self::Progress => "progress",
            Self::Detour => "detour",
            Self::Mission(index) => own.get(usize::from(index)).copied().unwrap_or("?"),
        }
    }
}

impl From<NoteKind> for u32 {
    fn from(kind: NoteKind) -> Self {
        match kind {
            NoteKind::Progress => NoteKind::PROGRESS,
            NoteKind::Detour => NoteKind::DETOUR,
            NoteKind::Mission(index) => match Self::from(index) {
                low if low < NoteKind::PROGRESS => low,
                high => high + 2,
            },
        }
    }
}

/// A number that is none of a note's is that of one that no mission declares.
impl From<u32> for NoteKind {
    fn from(number: u32) -> Self {
        match number {
            Self::PROGRESS => Self::Progress,
            Self::DETOUR => Self::Detour,
            low if low < Self::PROGRESS => Self::Mission(low as u8),
            high => Self::Mission(u8::try_from(high - 2).unwrap_or(u8::MAX)),
        }
    }
}

/// One row of allocation.csv: what a robot's allocator holds of one of its behaviors at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AllocationRow {
    /// The behavior's task.
    pub task: TaskId,
    /// The behavior.
    pub behavior: BehaviorId,
    /// What it is worth to the robot, in the allocator's own measure; finite.
    pub utility: f64,
    /// Who has the task as far as the robot knows.
    pub holder: Option<RobotId>,
    /// What the robot does about it.
    pub state: BehaviorState,
}
