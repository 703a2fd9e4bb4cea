//! What robots are told of a run.

use super::{Scenario, Setup};
use crate::fault::Faults;

impl Setup {
    /// The setup as robots know it: the map that they are given, the team and the parameters. What lies on the floor, what will go
    /// wrong and what the mission [keeps to itself](crate::mission::data::MissionData::brief) they find out, or not. The seed is in
    /// it, for a robot draws what becomes of the messages that it is sent.
    #[must_use]
    pub fn briefing(&self) -> Self {
        let mut scenario = Scenario {
            description: String::new(),
            obstacles: Vec::new(),
            faults: Faults::default(),
            ..self.scenario.clone()
        };
        scenario.mission().brief(&mut scenario.mission);
        Self {
            scenario,
            ..self.clone()
        }
    }

    /// The same as one robot's agent is told it: without parameters and profiles of its teammates, which would grow with the square of the
    /// team.
    #[must_use]
    pub fn briefing_of(&self, robot: &str) -> Self {
        let mut briefing = self.briefing();
        briefing.alliance.robots.retain(|name, _| name == robot);
        briefing.profile.robots.retain(|name, _| name == robot);
        briefing
    }
}
