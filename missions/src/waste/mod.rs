//! The hazardous waste clean-up (thesis §4.1): robots find the spills, carry their items to a deposit and report.
//!
//! - [`data`]: its section of a scenario, its tasks and behaviors, its words.
//! - [`world`]: spills, items, deposits and the report site. [`mind`]: what a robot of it knows and does.

pub mod data;
pub mod mind;
pub mod world;

#[cfg(test)]
mod rollback;

use crate::MissionParts;

/// Both sides of it.
pub const PARTS: MissionParts = MissionParts {
    world: world::WASTE,
    mind: mind::MIND,
};

#[cfg(test)]
mod tests {
    #[test]
    fn the_clean_up_keeps_the_laws_of_every_mission() {
        let scenario = "[waste]\nborder_known = true\nspills = [{ name = 'only', items = 2 }]\n";
        crate::testkit::mission(super::PARTS, scenario);
    }
}
