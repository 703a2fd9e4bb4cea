//! The world-server: physics, sensing and the step clock.

pub mod input;
pub mod recorder;
pub mod world;
