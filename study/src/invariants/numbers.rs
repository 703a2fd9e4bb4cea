//! Every number is finite and in its range: of bodies as of minds.

use std::f32::consts::PI;

use alliance_proto::scenario::Setup;

use super::{RobotState, WorldState};

/// Looks at them after a tick.
///
/// # Errors
/// What does not hold.
pub fn check(setup: &Setup, state: &WorldState) -> Result<(), String> {
    for (robot, spec) in state.robots.iter().zip(&setup.scenario.robots) {
        if let Some(what) = wrong(setup, robot) {
            return Err(format!("{}: {what}", spec.name));
        }
    }
    Ok(())
}

fn wrong(setup: &Setup, robot: &RobotState) -> Option<String> {
    let pose = robot.pose;
    // Written so that NaN is never in range.
    if !pose.position.is_finite() {
        return Some(format!("it is at {}", pose.position));
    }
    if !(-PI..=PI).contains(&pose.heading_rad) {
        return Some(format!("its heading is {} rad", pose.heading_rad));
    }
    if !(0.0..f32::INFINITY).contains(&robot.speed_m_s) {
        return Some(format!("its speed is {} m/s", robot.speed_m_s));
    }
    if let Some(energy_j) = robot.energy_j {
        let capacity_j = setup.scenario.energy.map_or(0.0, |it| it.capacity_j);
        if !(0.0..=capacity_j).contains(&energy_j) {
            return Some(format!("its energy is {energy_j} J of {capacity_j}"));
        }
    }
    let threshold = setup.alliance.threshold;
    robot.motivations.iter().find_map(|it| {
        if !(0.0..=threshold).contains(&it.motivation) {
            let what = format!("the motivation of set {} is {}", it.set.0, it.motivation);
            return Some(what);
        }
        let impatience = it.impatience;
        (!(0.0..f64::INFINITY).contains(&impatience))
            .then(|| format!("the impatience of set {} is {impatience}", it.set.0))
    })
}
