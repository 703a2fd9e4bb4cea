//! Invariant: every number is finite and in range, for bodies and controllers.

use std::f32::consts::PI;

use scenario::Setup;

use super::{RobotState, WorldState};

/// Checks all robots after a tick. The error describes the violation.
pub fn check(setup: &Setup, state: &WorldState) -> Result<(), String> {
    for (robot, spec) in state.robots.iter().zip(&setup.scenario.robots) {
        if let Some(what) = violation(setup, robot) {
            return Err(format!("{}: {what}", spec.name));
        }
    }
    Ok(())
}

fn violation(setup: &Setup, robot: &RobotState) -> Option<String> {
    let pose = robot.pose;
    // Written so that NaN is out of range.
    if !pose.position.is_finite() {
        return Some(format!("its position is {}", pose.position));
    }
    if !(-PI..=PI).contains(&pose.heading_rad) {
        return Some(format!("its heading is {} rad", pose.heading_rad));
    }
    if !(0.0..f32::INFINITY).contains(&robot.speed_m_s) {
        return Some(format!("its speed is {} m/s", robot.speed_m_s));
    }
    if let Some(energy_j) = robot.energy_j {
        let capacity_j = setup
            .scenario
            .energy
            .map_or(0.0, |energy| energy.capacity_j);
        if !(0.0..=capacity_j).contains(&energy_j) {
            return Some(format!("its energy is {energy_j} J of {capacity_j}"));
        }
    }
    let threshold = setup.alliance.threshold;
    robot.motivations.iter().find_map(|entry| {
        if !(0.0..=threshold).contains(&entry.motivation) {
            let what = format!(
                "the motivation of set {} is {}",
                entry.set.0, entry.motivation
            );
            return Some(what);
        }
        let impatience = entry.impatience;
        (!(0.0..f64::INFINITY).contains(&impatience))
            .then(|| format!("the impatience of set {} is {impatience}", entry.set.0))
    })
}
