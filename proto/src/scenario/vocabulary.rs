//! What a scenario may speak of beyond the frame.

use super::{AllocatorSpec, Scenario, ScenarioError};
use crate::ids::RobotId;
use crate::mission::data::BuiltinScenario;
use crate::mission::known::{Mission, NO_MISSION};

/// The missions and allocators that there are: handed in by whoever reads scenarios, as they come from other crates.
#[derive(Clone, Debug, PartialEq)]
pub struct Vocabulary {
    /// In the order in which they are listed to people; a scenario without a mission's section is one of the first.
    pub missions: Vec<Mission>,
    /// In the order in which they are listed to people.
    pub allocators: Vec<AllocatorSpec>,
}

impl Vocabulary {
    /// The scenarios that come with the missions, in their order.
    pub fn builtins(&self) -> impl Iterator<Item = &'static BuiltinScenario> {
        self.missions.iter().flat_map(|mission| mission.scenarios())
    }

    /// The scenario of that name that comes with a mission.
    #[must_use]
    pub fn builtin(&self, name: &str) -> Option<&'static BuiltinScenario> {
        self.builtins().find(|scenario| scenario.name == name)
    }

    /// The robots of a scenario whose allocators are told the truth, by rank.
    #[must_use]
    pub fn told_truth(&self, scenario: &Scenario) -> Vec<RobotId> {
        let is_told = |name: &str| {
            let mut all = self.allocators.iter();
            all.any(|spec| spec.name == name && spec.wants_truth)
        };
        let robots = scenario.robots.iter().zip(0..);
        let told = robots.filter(|(robot, _)| is_told(scenario.allocator_of(robot)));
        told.map(|(_, rank)| RobotId(rank)).collect()
    }

    /// Whether the robots of that allocator learn times that can be carried to a later run.
    #[must_use]
    pub fn learns(&self, allocator: &str) -> bool {
        let mut all = self.allocators.iter();
        all.any(|spec| spec.name == allocator && spec.learns)
    }

    /// The scenario in which nothing is stated: one of the first mission.
    ///
    /// # Errors
    /// When its section has keys that must be stated.
    pub fn default_scenario(&self) -> Result<Scenario, ScenarioError> {
        let mission = self.missions.first().copied().unwrap_or(NO_MISSION);
        Scenario::of(mission).map_err(|problem| problem.located(None))
    }
}
