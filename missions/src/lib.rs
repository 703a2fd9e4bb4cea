//! Missions: the only room that knows a mission's data, its world and its robots' minds.
//!
//! - [`Registry`]: the missions and allocators that a program knows.

mod registry;
pub mod waste;

pub use registry::{MissionParts, Registry};
