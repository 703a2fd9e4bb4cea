//! The `visit` mission: each place must be touched once, by any robot.

pub mod controller;
pub mod data;
pub mod world;

use missions::MissionParts;
use robot_agent::mission::ControllerConstructor;

/// The world part and the controller part of the mission, for registration.
pub const VISIT: MissionParts = MissionParts::new::<world::Visit>(data::VISIT, |_| {
    ControllerConstructor::new(controller::Visitor::new)
});

#[cfg(test)]
mod tests {
    const SCENARIO: &str = include_str!("../visit.toml");

    #[test]
    fn visit_passes_the_mission_testkit() {
        missions::testkit::check_mission(super::VISIT, SCENARIO);
    }
}
