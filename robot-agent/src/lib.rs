//! The robot-agent: one robot's mind.

pub mod alliance;
pub mod body;
pub mod missions;
