//! Missions, as far as files and messages know them.

pub mod data;
pub mod waste_data;
