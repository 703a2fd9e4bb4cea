//! Observe: robots keep moving targets in sight (CMOMMT, docs/missions/observe.md).
//!
//! - [`data`]: the scenario section, tasks, behaviors and terms. [`bus`]: readings, actions and shared knowledge.
//! - [`world`]: the targets and their observation. [`controller`]: the controller of a robot.

pub mod bus;
pub mod controller;
pub mod data;
pub mod world;

use robot_agent::mission::ControllerConstructor;

use crate::MissionParts;

pub const MISSION: MissionParts = MissionParts::new::<world::Observe>(data::OBSERVE, |_| {
    ControllerConstructor::new(controller::Observer::new)
});
