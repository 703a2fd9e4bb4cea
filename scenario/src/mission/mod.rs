//! The part of a mission that scenarios and files contain: its section ([`data`]), its columns of mission.csv ([`columns`]) and its figures.

pub mod columns;
pub mod data;
mod figures;
pub mod registry;
pub mod prelude;
pub mod expected_properties;
pub mod section;

pub use figures::{MissionFigures, Target, TeamFigures, Value};
