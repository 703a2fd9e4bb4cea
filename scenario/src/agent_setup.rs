//! The part of a setup that robots receive.

use std::sync::Arc;

use super::{Scenario, Setup};
use crate::fault::Faults;

impl Setup {
    /// Returns the setup for robots: the map, the team and the parameters. It omits faults and the values that the
    /// mission [withholds](crate::mission::data::MissionData::withhold). It omits the obstacles, too, unless the robots
    /// [know them](crate::mission::data::MissionData::knows_obstacles). It contains the seed, because a receiver draws
    /// the delivery of its messages.
    #[must_use]
    pub fn for_robots(&self) -> Self {
        let mut scenario = Scenario {
            description: String::new(),
            faults: Faults::default(),
            ..self.scenario.clone()
        };
        if !scenario.mission().knows_obstacles(&scenario) {
            scenario.obstacles.clear();
        }
        scenario.mission().withhold(&mut scenario.mission);
        Self {
            scenario,
            ..self.clone()
        }
    }

    /// Returns the setup for one robot's agent. It omits its teammates' parameters and profiles, which would grow with
    /// the square of the team.
    #[must_use]
    pub fn for_robot(&self, robot: &str) -> Self {
        let mut briefing = self.for_robots();
        let own = self.alliance.robots.get_key_value(robot);
        let own = own.map(|(name, params)| (name.clone(), params.clone()));
        briefing.alliance.robots = Arc::new(own.into_iter().collect());
        briefing.profile.robots.retain(|name, _| name == robot);
        briefing
    }
}
