//! What the simulation hands to the recorder after every tick: plain data, borrowed for the length of one call.

use std::fmt;

use alliance_proto::ids::{BehaviorId, RobotId, Tick};
use alliance_proto::log::Input;
use alliance_proto::readings::Pose;
use alliance_proto::team::Broadcast;
use alliance_proto::telemetry::BehaviorState;
use alliance_proto::time::SimTime;
use serde::{Serialize, Serializer};

use super::answers::Answer;
use alliance_proto::mission::{Target, Value};

/// Everything that happened in one tick.
#[derive(Clone, Copy, Debug)]
pub struct TickRecord<'a> {
    /// Number of the tick.
    pub tick: Tick,
    /// Its simulated time, `tick · step`.
    pub now: SimTime,
    /// What came from outside and changed the run in this tick.
    pub inputs: &'a [Input],
    /// Every robot's body, counted in or not, by rank.
    pub bodies: &'a [BodyRecord],
    /// What each agent did, by rank.
    pub answers: &'a [Answer],
    /// Whose minds are programs of their own, by rank: their answers are kept in full. Empty where nobody's is.
    pub foreign: &'a [bool],
    /// What these have said: the broadcasts that came, in any order.
    pub said: &'a [Broadcast],
    /// What the world did in this tick's step, in order. Inputs, state changes and notes need no entry here: their rows of
    /// events.csv are made from [`TickRecord::inputs`] and from the reports.
    pub events: &'a [Event],
    /// How far the mission has come after the step, in the columns of mission.csv.
    pub mission: &'a [Value],
    /// The mission's targets after the step.
    pub targets: &'a [Target],
    /// Hash of all of the mission's state after the step.
    pub mission_state: u64,
}

impl<'a> TickRecord<'a> {
    /// The answers that count, by rank.
    pub fn counted(&self) -> impl Iterator<Item = &'a Answer> + use<'a> {
        self.answers.iter().filter(|answer| answer.counts)
    }
}

/// A robot's body as a tick finds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BodyRecord {
    /// Whether it is in the mission at all; not hashed, for what makes it so is.
    #[serde(skip)]
    pub present: bool,
    /// Where it is.
    pub pose: Pose,
    /// Its speed in the step before, m/s.
    pub speed_m_s: f32,
    /// Whether it carries something.
    pub carrying: bool,
    /// Energy left, J; `None` where energy is not simulated.
    pub energy_j: Option<f32>,
    /// Behavior set that its agent last reported as active, in this tick or before.
    pub active: Option<BehaviorId>,
}

/// A row of events.csv.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// To or by whom; `None`: to the world.
    pub robot: Option<RobotId>,
    /// What it is about, such as an item.
    pub subject: String,
    /// Why.
    pub reason: String,
    /// Anything else.
    pub detail: String,
}

impl Event {
    /// An event of which nothing is known but kind and robot.
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

/// The `kind` column of events.csv.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// A behavior set changed into this state.
    State(BehaviorState),
    /// An agent noted something that has this name.
    Note(&'static str),
    /// Something of the mission, which gives it its name.
    Mission(&'static str),
    /// A robot's energy ran out.
    EnergyOut,
    /// An agent takes part from this tick on.
    Joined,
    /// An agent died.
    Gone,
    /// An agent fell silent.
    Stalled,
    /// A silent agent spoke again.
    Back,
    /// A broadcast got lost, though nobody asked for it.
    Lost,
    /// Something about a fault, whose id is the subject.
    Fault(FaultEvent),
}

/// What happened to a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultEvent {
    /// It waits for its trigger.
    Armed,
    /// It takes effect.
    Applied,
    /// It has changed something, for the first time since it was applied.
    Hit,
    /// It is in force no more.
    Healed,
    /// It was taken back before it took effect.
    Disarmed,
    /// It could not do what it should.
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

/// By name, so that a new kind does not change the hashes of old runs.
impl Serialize for EventKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
