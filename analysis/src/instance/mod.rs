//! Task allocation instances: files of other programs as scenarios, and runs as instances.
//!
//! - [`model`]: an instance, independent of its format. [`formats`]: readers of files. [`check`]: checks with lines.
//! - [`properties`]: the table of properties that the mission may or may not state. [`mod@write`]: an instance as a scenario.
//! - [`mod@from_scenario`] and [`result`]: a scenario and a run as an instance.
//! - [`map`]: occupancy maps as obstacles. [`mod@convert`]: from the text of a file to a scenario. [`command`]: `alliance
//!   import`.

pub mod check;
pub mod command;
pub mod convert;
pub mod formats;
pub mod frame;
pub mod from_scenario;
pub mod kinds;
pub mod map;
pub mod model;
pub mod properties;
pub mod result;
pub mod source;
pub mod team;
#[cfg(test)]
mod tests;
pub mod write;
