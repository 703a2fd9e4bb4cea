//! The room for robots around a point.

use std::f64::consts::PI;

use scenario::Scenario;

/// Returns whether this number of robots fits side by side within the reach of a point.
pub(super) fn has_room(scenario: &Scenario, reach_m: f32, workers: u32) -> bool {
    let (reach, radius) = (f64::from(reach_m), f64::from(scenario.body.radius_m));
    let between = 2.0 * reach * (PI / f64::from(workers)).sin();
    scenario.body.robot_penetrability > 0.0 || workers <= 1 || between >= 2.0 * radius
}
