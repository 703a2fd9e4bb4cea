//! Missions.
pub mod waste;
