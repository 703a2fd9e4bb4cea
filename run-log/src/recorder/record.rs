//! The data of a tick that the simulation passes to the recorder, borrowed for one call.

use std::fmt;

use crate::Input;
use proto::readings::Pose;
use proto::team::Broadcast;
use proto::telemetry::BehaviorState;
use proto::tick::Report;
use scenario::ids::{BehaviorId, RobotId, Tick};
use scenario::time::SimTime;
use serde::{Serialize, Serializer};

use super::answers::Answer;
use scenario::mission::{FigureValue, Target};

#[derive(Clone, Copy, Debug)]
pub struct TickRecord<'a> {
    pub tick: Tick,
    /// The simulated time of the tick, `tick · step`.
    pub now: SimTime,
    /// External inputs that changed the run in this tick.
    pub inputs: &'a [Input],
    pub bodies: &'a [BodyRecord],
    /// Answers of all agents in order of rank.
    pub answers: &'a [Answer],
    /// By rank: `true` for external controllers, whose answers are stored in full. Empty if the team has none.
    pub external: &'a [bool],
    /// The received broadcasts of external controllers, in any order.
    pub broadcasts: &'a [Broadcast],
    /// The messages of allocators whose reports count, by sender and index. Empty unless the log is full
    /// or compact.
    pub allocation_messages: &'a [Broadcast],
    /// The world's events in this step, in order. Inputs, state changes and notes are not among them, because their rows of
    /// events.csv are made from [`TickRecord::inputs`] and from the reports.
    pub events: &'a [Event],
    /// The effects of faults in this tick, each fault once.
    pub hits: &'a [FaultHits],
    pub mission: &'a [FigureValue],
    pub targets: &'a [Target],
    /// The hash of the complete mission state after the step.
    pub mission_state: u64,
}

impl<'a> TickRecord<'a> {
    /// Returns the answers that count, by rank.
    pub fn counted(&self) -> impl Iterator<Item = &'a Answer> + use<'a> {
        self.answers.iter().filter(|answer| answer.counts)
    }

    /// Returns the counted reports of the robots that sent broadcasts, by rank.
    pub(super) fn senders(&self) -> impl Iterator<Item = &'a Report> + use<'a> {
        let reports = self.counted().map(|answer| &answer.report);
        reports.filter(|report| report.broadcasts > 0)
    }
}

/// The effects of a fault in a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultHits {
    /// The id of the fault.
    pub fault: String,
    pub count: u64,
}

/// A robot's body at the beginning of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BodyRecord {
    /// `true` if the robot is in the mission. Not hashed, because the cause of a change is hashed.
    #[serde(skip)]
    pub present: bool,
    pub pose: Pose,
    /// The speed in the previous step, m/s.
    pub speed_m_s: f32,
    pub carrying: bool,
    /// The remaining energy, J; `None` if energy is not simulated.
    pub energy_j: Option<f32>,
    /// The behavior set that the agent last reported as active.
    pub active: Option<BehaviorId>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Event {
    pub kind: EventKind,
    /// The robot of the event; `None` for events of the world.
    pub robot: Option<RobotId>,
    /// The object of the event, such as an item or a fault.
    pub subject: String,
    pub reason: String,
    pub detail: String,
}

impl Event {
    #[must_use]
    pub fn new(kind: EventKind, robot: Option<RobotId>) -> Self {
        Self {
            kind,
            robot,
            subject: String::new(),
            reason: String::new(),
            detail: String::new(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    State(BehaviorState),
    Note(&'static str),
    Mission(&'static str),
    EnergyOut,
    /// An agent takes part from this tick on.
    Joined,
    Gone,
    Stalled,
    Back,
    Lost,
    /// A fault changed its state. The subject is the fault's id.
    Fault(FaultEvent),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultEvent {
    Armed,
    Applied,
    /// The fault has changed something for the first time since it took effect.
    Hit,
    Healed,
    /// The fault was cleared before it took effect.
    Disarmed,
    Failed,
}

impl fmt::Display for EventKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::State(BehaviorState::Hibernating) => "hibernated",
            Self::State(BehaviorState::Waiting) => "waiting",
            Self::State(BehaviorState::Active) => "activated",
            Self::Note(name) => name,
            Self::Mission(kind) => kind,
            Self::EnergyOut => "energy-out",
            Self::Joined => "joined",
            Self::Gone => "gone",
            Self::Stalled => "stalled",
            Self::Back => "back",
            Self::Lost => "lost",
            Self::Fault(FaultEvent::Armed) => "armed",
            Self::Fault(FaultEvent::Applied) => "applied",
            Self::Fault(FaultEvent::Hit) => "hit",
            Self::Fault(FaultEvent::Healed) => "healed",
            Self::Fault(FaultEvent::Disarmed) => "disarmed",
            Self::Fault(FaultEvent::Failed) => "failed",
        })
    }
}

/// Serializes the name, so that new kinds do not change the hashes of old runs.
impl Serialize for EventKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
