//! Push: robots push a long bar over a line, one end after the other (docs/missions/push.md).
//!
//! - [`data`]: the scenario section, tasks and terms. [`bus`]: readings and shared knowledge. [`bar`]: the geometry
//!   of a bar.
//! - [`world`]: the motion of bars. [`controller`]: the controller of a robot.

pub mod bar;
pub mod bus;
pub mod controller;
pub mod data;
pub mod world;

use robot_agent::mission::ControllerConstructor;

use crate::MissionParts;

pub const MISSION: MissionParts = MissionParts::new::<world::PushWorld>(data::PUSH, |_| {
    ControllerConstructor::new(controller::Pusher::new)
});
