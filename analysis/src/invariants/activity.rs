//! Invariant: a robot has at most one active behavior set.

use proto::telemetry::BehaviorState;
use scenario::Scenario;

use super::{RobotState, WorldState};

/// Checks all robots after a tick. The error describes the violation.
pub fn check(scenario: &Scenario, state: &WorldState) -> Result<(), String> {
    for (robot, spec) in state.robots.iter().zip(&scenario.robots) {
        let active = robot.active().count();
        if active > 1 {
            return Err(format!("{} has {active} active behavior sets", spec.name));
        }
    }
    Ok(())
}

impl RobotState {
    /// Returns the behavior sets that the robot executes, from its latest report.
    pub fn active(&self) -> impl Iterator<Item = scenario::ids::BehaviorId> + '_ {
        let motivations = self.motivations.iter();
        motivations
            .filter(|motivation| motivation.state == BehaviorState::Active)
            .map(|motivation| motivation.set)
    }
}
