//! Service: points of work that arrive, take time and skills, and may expire or come back (docs/missions/service.md).
//!
//! - [`data`]: scenario section, tasks, behaviors and terms. [`bus`]: sensor readings, actions and messages.
//! - [`world`]: the points, and the board that announces them. [`controller`]: the robot controller.

pub mod bus;
pub mod controller;
pub mod data;
pub mod world;

use world_server::mission::MissionWorld;

use crate::MissionParts;

pub const MISSION: MissionParts = MissionParts {
    world: MissionWorld::typed::<world::Service>(data::SERVICE),
    controller: controller::CONTROLLER,
};

#[cfg(test)]
mod tests;
