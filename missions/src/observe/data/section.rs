//! `[observe]` of a scenario.

use alliance_proto::scenario::Scenario;
use serde::{Deserialize, Serialize};

/// What a scenario says of its targets, and of how robots watch them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserveSection {
    /// Number of targets.
    pub n: u16,
    /// How fast the slowest target may be, m/s.
    pub slowest_m_s: f32,
    /// How fast the fastest target may be, m/s.
    pub fastest_m_s: f32,
    /// How often a target turns, 1/s.
    pub turn_hz: f64,
    /// How far it turns at most, to either side, degrees.
    pub turn_deg: f32,
    /// Where targets are.
    pub region: Region,
    /// How far robots sense targets, m.
    pub range_m: f32,
    /// Up to where robots count on targets that they remember or hear of, m.
    pub predict_m: f32,
    /// Where a target neither attracts nor repels, m.
    pub target_near_m: f32,
    /// From where on it attracts in full, m.
    pub target_full_m: f32,
    /// Up to where a robot repels in full, m.
    pub robot_near_m: f32,
    /// From where on it repels no more, m.
    pub robot_far_m: f32,
    /// What attracts robots where.
    pub policy: Policy,
    /// Weight of a target that a teammate sees, too.
    pub shared_weight: f32,
    /// How long the mission is, s.
    pub duration_s: f64,
}

/// Where targets are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    /// In the largest disc in the middle of the room.
    Disc,
    /// Anywhere.
    Room,
}

/// What a robot does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// It stays where it is.
    Fixed,
    /// It moves about at random.
    Random,
    /// It follows the sum of the forces of targets and robots that are near.
    Local,
    /// The same, with less weight on targets that teammates see, too.
    ACmommt,
}

/// What a task is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Duty {
    /// To keep targets in sight.
    Observe,
    /// To look for targets.
    Search,
}

impl ObserveSection {
    /// That of a scenario of this mission.
    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }
}

impl Policy {
    /// The tasks, in the catalog's order.
    #[must_use]
    pub fn duties(self) -> &'static [Duty] {
        match self {
            Self::Fixed => &[Duty::Observe],
            Self::Random => &[Duty::Search],
            Self::Local | Self::ACmommt => &[Duty::Observe, Duty::Search],
        }
    }
}

impl Duty {
    /// The name of the task and of its behavior.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Observe => "observe",
            Self::Search => "search",
        }
    }
}
