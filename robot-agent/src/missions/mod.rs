//! Missions: behavior sets and what a robot knows.

pub mod waste;
