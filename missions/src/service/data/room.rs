//! The room for robots around a point.

use std::f64::consts::PI;

use scenario::Scenario;

use super::ServiceSection;

/// The distance that robots keep from each other when they stand at a point, m.
const GAP_M: f32 = 0.1;

/// Returns whether this number of robots fits side by side within the reach of a point.
pub(super) fn has_room(scenario: &Scenario, reach_m: f32, workers: u32) -> bool {
    let (reach, radius) = (f64::from(reach_m), f64::from(scenario.body.radius_m));
    let between = 2.0 * reach * (PI / f64::from(workers)).sin();
    scenario.body.robot_penetrability > 0.0 || workers <= 1 || between >= 2.0 * radius
}

/// Returns the reach of a point at which several robots work together, m: at least twice the distance of two robots
/// side by side. Robots stop at half the reach, so that each of them leaves room within reach for one behind it. A disc
/// of this radius holds 18 robots around its center.
#[must_use]
pub fn crew_reach_m(scenario: &Scenario) -> f32 {
    let reach_m = ServiceSection::of(scenario).reach_m;
    if scenario.body.robot_penetrability > 0.0 {
        return reach_m;
    }
    reach_m.max(2.0 * (2.0 * scenario.body.radius_m + GAP_M))
}
