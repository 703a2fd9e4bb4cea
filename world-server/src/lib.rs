//! The world-server: physics, sensing and the step clock.

pub mod world;
