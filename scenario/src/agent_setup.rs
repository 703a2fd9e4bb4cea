//! The part of a setup that robots receive.

use super::{Scenario, Setup};
use crate::fault::Faults;

impl Setup {
    /// Returns the setup for robots: the map, the team and the parameters. It omits obstacles, faults and the values
    /// that the mission [withholds](crate::mission::data::MissionData::withhold). It contains the seed, because a receiver
    /// draws the delivery of its messages.
    #[must_use]
    pub fn for_robots(&self) -> Self {
        let mut scenario = Scenario {
            description: String::new(),
            obstacles: Vec::new(),
            faults: Faults::default(),
            ..self.scenario.clone()
        };
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
        briefing.alliance.robots.retain(|name, _| name == robot);
        briefing.profile.robots.retain(|name, _| name == robot);
        briefing
    }
}
