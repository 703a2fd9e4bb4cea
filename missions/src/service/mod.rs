//! Service: points of work that arrive, take time and skills, and may expire or come back (docs/missions/service.md).
//!
//! - [`data`]: scenario section, tasks, behaviors and terms. [`bus`]: sensor readings, actions and messages.
//! - [`world`]: the points, and the board that announces them. [`controller`]: the robot controller.

pub mod bus;
pub mod controller;
pub mod data;
pub mod world;

use robot_agent::mission::ControllerKind;
use world_server::mission::WorldKind;

use crate::MissionParts;

pub const MISSION: MissionParts = MissionParts {
    world: WorldKind::new::<world::Service>(data::SERVICE),
    controller: ControllerKind {
        planned_cost_ms: controller::planned_cost_ms,
        ..ControllerKind::new(data::SERVICE, controller::constructor)
    },
};
