//! The hazardous waste clean-up (thesis §4.1): robots find the spills, carry their items to a deposit and report.
//!
//! - [`data`]: scenario section, tasks, behaviors and terms.
//! - [`world`]: spills, items, deposits and the report site. [`controller`]: the robot controller.

pub mod controller;
pub mod data;
pub mod world;

#[cfg(test)]
mod rollback;

use crate::MissionParts;

pub const MISSION: MissionParts = MissionParts {
    world: world::WASTE,
    controller: controller::CONTROLLER,
};

#[cfg(test)]
mod tests {
    #[test]
    fn the_clean_up_passes_the_checks_of_every_mission() {
        let scenario = "[waste]\nborder_known = true\nspills = [{ name = 'only', items = 2 }]\n";
        crate::testkit::check_mission(super::MISSION, scenario);
    }
}
