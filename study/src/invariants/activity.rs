//! A robot does one thing at a time.

use alliance_proto::scenario::Scenario;
use alliance_proto::telemetry::BehaviorState;

use super::{RobotState, WorldState};

/// Looks at all robots after a tick.
///
/// # Errors
/// What does not hold.
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
    /// The behavior sets that it executes, as it last reported.
    pub fn active(&self) -> impl Iterator<Item = alliance_proto::ids::BehaviorId> + '_ {
        let motivations = self.motivations.iter();
        motivations
            .filter(|it| it.state == BehaviorState::Active)
            .map(|it| it.set)
    }
}
