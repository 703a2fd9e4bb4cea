//! Observe: robots keep moving targets in sight (CMOMMT, docs/missions/observe.md).
//!
//! - [`data`]: its section of a scenario, its tasks and behaviors, its words. [`bus`]: what is sensed, done and told.
//! - [`world`]: the targets, and who sees which. [`mind`]: what a robot of it knows and does.

pub mod bus;
pub mod data;
pub mod mind;
pub mod world;

use crate::MissionParts;

/// Both sides of it.
pub const PARTS: MissionParts = MissionParts::of::<world::Observe, mind::Observer>(data::OBSERVE);

#[cfg(test)]
mod tests;
