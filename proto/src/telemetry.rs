//! Data that an agent sends to the world for the log: motivations with their factors, reasons of state changes, and the
//! delivery of every message.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::team::{BroadcastKind, TaskState};
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

/// The state of a behavior set (thesis §3.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum BehaviorState {
    /// Below the threshold, or suppressed.
    #[default]
    Hibernating,
    /// At the threshold while a teammate executes the exclusive task.
    Waiting,
    Active,
}

impl BehaviorState {
    /// Returns the `state` column of motivations.csv.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Hibernating => "hibernating",
            Self::Waiting => "waiting",
            Self::Active => "active",
        }
    }
}

/// A row of motivations.csv: a motivational behavior at the end of a step, with the factors of eq. 2.7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Motivation {
    pub set: BehaviorId,
    /// The motivation m, in [0, θ].
    pub motivation: f64,
    /// The rate of this step, motivation/s (eq. 2.4).
    pub impatience: f64,
    /// The factor of eq. 2.1.
    pub sensory_feedback: bool,
    /// The factor of eq. 2.3; `false` if another set of the robot is active.
    pub activity_suppression: bool,
    /// The factor of eq. 2.5; `false` for a reset in this step.
    pub impatience_reset: bool,
    /// The factor of eq. 2.6; `false` if the robot yields or gives up.
    pub acquiescence: bool,
    pub state: BehaviorState,
}

/// The reason for a change of a behavior set's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    Threshold,
    /// The factor sensory_feedback became 0.
    NotApplicable,
    /// Another set of the robot is active.
    Suppressed,
    /// The first message of this teammate caused an impatience_reset.
    ResetBy(RobotId),
    /// The set was active longer than ψ and a teammate claims the task.
    AcquiescedPsi,
    /// The set was active longer than λ.
    GaveUpLambda,
    /// An earlier or lower-ranked claim to the same exclusive task won.
    Arbitration,
    /// The set waited, and no robot executes the task any more.
    WaitOver,
    /// The set waited for its own ψ + τ without success; the incumbent may be deaf or babbling.
    WaitBound,
    Chosen,
    /// The allocator prefers another set.
    Reassigned,
    /// The task had no known executor.
    Claimed,
    /// A teammate's claim or bid is better.
    Outbid,
    Awarded,
    /// A contract was not renewed in time.
    LeaseEnded,
    /// The supervisor of the task observed no progress.
    NoProgress,
    Drawn,
}

impl Reason {
    /// Returns the `reason` column of events.csv, with teammates by name.
    #[must_use]
    pub fn describe<'a>(self, name: impl Fn(RobotId) -> &'a str) -> String {
        match self {
            Self::ResetBy(robot) => format!("{} {}", self.as_str(), name(robot)),
            _ => self.as_str().to_owned(),
        }
    }

    /// Returns the reason in the `reason` column of events.csv, without a teammate.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Threshold => "threshold",
            Self::NotApplicable => "not-applicable",
            Self::Suppressed => "suppressed",
            Self::ResetBy(_) => "reset-by",
            Self::AcquiescedPsi => "acquiesced-psi",
            Self::GaveUpLambda => "gave-up-lambda",
            Self::Arbitration => "arbitration",
            Self::WaitOver => "wait-over",
            Self::WaitBound => "wait-bound",
            Self::Chosen => "chosen",
            Self::Reassigned => "reassigned",
            Self::Claimed => "claimed",
            Self::Outbid => "outbid",
            Self::Awarded => "awarded",
            Self::LeaseEnded => "lease-ended",
            Self::NoProgress => "no-progress",
            Self::Drawn => "drawn",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StateChange {
    pub set: BehaviorId,
    pub from: BehaviorState,
    pub to: BehaviorState,
    pub reason: Reason,
}

/// The delivery of a broadcast at one receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Delivery {
    /// Received in the step after it was sent.
    Received,
    /// Listed by the world but not arrived: a real loss on the network.
    Lost,
    /// Received late, because a fault of the link delayed it, held it back or let it be overtaken.
    Delayed,
    /// A second copy, which is ignored.
    Duplicate,
    /// Lost because of a fault of the link.
    Dropped,
    /// Cut off: mute, deaf, partition, out of range, or due when the receiver did not take part.
    Cut,
    /// In flight. [`Delivery::Delayed`], [`Delivery::Damaged`] or [`Delivery::Cut`] follows, unless the receiver or the run
    /// ends first.
    Pending,
    /// The message was lost by fading.
    Faded,
    /// Lost because an obstacle lies between sender and receiver.
    Blocked,
    /// Lost because of bit errors: a checksum does not match, or the payload cannot be decoded.
    Corrupted,
    /// Received with bit errors, at once or late. The logged content is that of the damaged message.
    Damaged,
}

impl Delivery {
    /// Returns the `delivery` column of messages.csv.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Received => "received",
            Self::Lost => "lost",
            Self::Delayed => "delayed",
            Self::Duplicate => "duplicate",
            Self::Dropped => "dropped",
            Self::Cut => "cut",
            Self::Pending => "pending",
            Self::Faded => "faded",
            Self::Blocked => "blocked",
            Self::Corrupted => "corrupted",
            Self::Damaged => "damaged",
        }
    }

    /// Returns true if the receiver misses the message.
    #[must_use]
    pub fn is_missed(self) -> bool {
        match self {
            Self::Lost
            | Self::Dropped
            | Self::Cut
            | Self::Faded
            | Self::Blocked
            | Self::Corrupted => true,
            Self::Received | Self::Delayed | Self::Duplicate | Self::Pending | Self::Damaged => {
                false
            }
        }
    }
}

/// A row of messages.csv: a broadcast at one receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Reception {
    /// The time at which it was received, or would have been.
    pub at: SimTime,
    pub sender: RobotId,
    pub incarnation: Incarnation,
    pub sent: SimTime,
    pub delivery: Delivery,
    /// The logged contents; `None` if the broadcast did not arrive.
    pub content: Option<BroadcastSummary>,
}

/// The logged part of a broadcast's contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct BroadcastSummary {
    pub seq: u64,
    pub kind: BroadcastKind,
    /// The sender's state; heartbeats only.
    pub state: Option<TaskState>,
    /// The start of the sender's state; heartbeats only.
    pub since: Option<SimTime>,
    pub set: Option<BehaviorId>,
    pub task: Option<TaskId>,
    pub progress: Option<u32>,
}

/// A log entry of an agent other than a state change.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note {
    /// The `kind` column of events.csv.
    pub kind: NoteKind,
    /// The `detail` column of events.csv.
    pub detail: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "u32", into = "u32")]
pub enum NoteKind {
    /// An effect on the world.
    Progress,
    /// A detour around an obstacle. The detail contains the stored detour.
    Detour,
    /// A note of the mission, by its index among the mission's declared notes.
    Mission(u8),
}

impl NoteKind {
    /// The numbers of the common kinds on the bus. The mission's kinds use the other numbers.
    const PROGRESS: u32 = 5;
    const DETOUR: u32 = 6;

    /// Returns the `kind` column of events.csv. `declared` are the kinds of the mission.
    #[must_use]
    pub fn as_str(self, declared: &'static [&'static str]) -> &'static str {
        match self {
            Self::Progress => "progress",
            Self::Detour => "detour",
            Self::Mission(index) => declared.get(usize::from(index)).copied().unwrap_or("?"),
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

/// Numbers without a kind become a mission kind that no mission declares.
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

/// A row of allocation.csv: an allocator's state of one behavior at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AllocationRow {
    pub task: TaskId,
    pub behavior: BehaviorId,
    /// The utility for the robot, in the allocator's own unit; finite.
    pub utility: f64,
    /// The robot that executes the task, according to this robot.
    pub holder: Option<RobotId>,
    pub state: BehaviorState,
}
