//! The missions and allocators that a scenario can use.

use super::{AllocatorSpec, Problem, Scenario};
use crate::ids::RobotId;
use crate::mission::data::BuiltinScenario;
use crate::mission::registry::{Mission, NO_MISSION};

/// The known missions and allocators. They come from other crates, so the reader of a scenario supplies them.
#[derive(Clone, Debug, PartialEq)]
pub struct Vocabulary {
    /// The missions in display order. A scenario without a mission's section has the first one.
    pub missions: Vec<Mission>,
    /// The allocators in display order.
    pub allocators: Vec<AllocatorSpec>,
}

impl Vocabulary {
    /// Returns the scenarios that come with the missions, in their order.
    pub fn builtins(&self) -> impl Iterator<Item = &'static BuiltinScenario> {
        self.missions
            .iter()
            .flat_map(|mission| mission.vocabulary().scenarios)
    }

    /// Returns the scenario with this name that comes with a mission.
    #[must_use]
    pub fn builtin(&self, name: &str) -> Option<&'static BuiltinScenario> {
        self.builtins().find(|scenario| scenario.name == name)
    }

    /// Returns the robots of a scenario whose allocators receive the ground truth, by rank.
    #[must_use]
    pub fn ground_truth_robots(&self, scenario: &Scenario) -> Vec<RobotId> {
        let receives_truth = |name: &str| {
            let mut all = self.allocators.iter();
            all.any(|spec| spec.name == name && spec.needs_ground_truth)
        };
        let robots = scenario.robots.iter().zip(0..);
        let receivers = robots.filter(|(robot, _)| receives_truth(scenario.decider_of(robot)));
        receivers.map(|(_, rank)| RobotId(rank)).collect()
    }

    /// Returns true if the robots of the allocator learn times for later runs.
    #[must_use]
    pub fn learns(&self, allocator: &str) -> bool {
        let mut all = self.allocators.iter();
        all.any(|spec| spec.name == allocator && spec.learns_times)
    }

    /// Creates the scenario that states nothing. It has the first mission.
    pub fn default_scenario(&self) -> Result<Scenario, Problem> {
        let mission = self.missions.first().copied().unwrap_or(NO_MISSION);
        Scenario::for_mission(mission)
    }
}
