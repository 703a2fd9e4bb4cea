//! The part of a mission that scenarios and files contain: its section ([`data`]), its columns of mission.csv ([`columns`]) and its figures.

pub mod columns;
pub mod data;
pub mod expected_properties;
mod figures;
pub mod prelude;
pub mod registry;
pub mod section;

pub use figures::{FigureValue, MissionFigures, Target, TeamFigures};
