//! Push: a long bar, to be pushed over a line end by end, in turns (docs/missions/push.md).
//!
//! - [`data`]: its section of a scenario, its tasks, its words. [`bus`]: what is sensed and told. [`bar`]: where a bar's ends are.
//! - [`world`]: how bars give way. [`mind`]: what a robot of it knows and does.

pub mod bar;
pub mod bus;
pub mod data;
pub mod mind;
pub mod world;

use crate::MissionParts;

/// Both sides of it.
pub const PARTS: MissionParts = MissionParts::of::<world::Pushed, mind::Pusher>(data::PUSH);

#[cfg(test)]
mod tests;
