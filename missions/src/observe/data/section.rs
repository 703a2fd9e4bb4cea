//! Section `[observe]` of a scenario.

use scenario::Scenario;
use serde::{Deserialize, Serialize};

/// The parameters of targets and of their observation. The module `parameters` describes each key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserveSection {
    pub n: u32,
    pub slowest_m_s: f32,
    pub fastest_m_s: f32,
    pub turn_hz: f64,
    pub turn_deg: f32,
    pub region: Region,
    pub range_m: f32,
    pub predict_m: f32,
    pub target_near_m: f32,
    pub target_full_m: f32,
    pub robot_near_m: f32,
    pub robot_far_m: f32,
    pub policy: Policy,
    pub shared_weight: f32,
    pub duration_s: f64,
}

/// The area in which targets move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    Disc,
    Room,
}

/// The rule of motion for robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    Fixed,
    Random,
    /// Robots follow the sum of the forces of near targets and robots.
    Local,
    /// Like `Local`, with a lower weight for targets that teammates see, too.
    ACmommt,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskKind {
    Observe,
    Search,
}

impl ObserveSection {
    #[must_use]
    pub fn from_scenario(scenario: &Scenario) -> &Self {
        scenario.section()
    }
}

impl Policy {
    #[must_use]
    pub fn duties(self) -> &'static [TaskKind] {
        match self {
            Self::Fixed => &[TaskKind::Observe],
            Self::Random => &[TaskKind::Search],
            Self::Local | Self::ACmommt => &[TaskKind::Observe, TaskKind::Search],
        }
    }
}

impl TaskKind {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Observe => "observe",
            Self::Search => "search",
        }
    }
}
