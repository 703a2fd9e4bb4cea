//! The hazardous waste clean-up (thesis §4.1): robots find the spills, carry their items to a deposit and report.
//!
//! - [`data`]: scenario section, tasks, behaviors and terms.
//! - [`world`]: spills, items, deposits and the report site. [`controller`]: the robot controller.

pub mod controller;
pub mod data;
pub mod world;

#[cfg(test)]
mod rollback;

use robot_agent::mission::ControllerKind;
use world_server::mission::WorldKind;

use crate::MissionParts;

pub const MISSION: MissionParts = MissionParts {
    world: WorldKind::new::<world::Waste>(data::WASTE),
    controller: ControllerKind {
        planned_cost_ms: controller::planned_cost_ms,
        ..ControllerKind::new(data::WASTE, controller::constructor)
    },
};
