//! The part of a mission that scenarios and files contain: its section ([`data`]), its columns of mission.csv ([`columns`]) and its figures.

pub mod columns;
pub mod data;
mod figures;
pub mod known;
pub mod prelude;
pub mod promises;
pub mod section;

pub use figures::{MissionFigures, Target, TeamFigures, Value};
