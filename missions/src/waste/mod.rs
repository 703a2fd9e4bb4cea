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
