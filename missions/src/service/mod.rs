//! Service: points of work that arrive, take time and skills, and may expire or come back (docs/missions/service.md).
//!
//! - [`data`]: its section of a scenario, its tasks and behaviors, its words. [`bus`]: what is sensed, done and told.
//! - [`world`]: the points, and what is written on the board. [`mind`]: what a robot of it knows and does.

pub mod bus;
pub mod data;
pub mod mind;
pub mod world;

use world_server::mission::MissionWorld;

use crate::MissionParts;

/// Both sides of it.
pub const PARTS: MissionParts = MissionParts {
    world: MissionWorld::of::<world::Service>(data::SERVICE),
    mind: mind::MIND,
};

#[cfg(test)]
mod tests;
