//! Missions: the only room that knows a mission's data, its world and its robots' minds.
//!
//! - [`Registry`]: the missions and allocators that a program knows. [`testkit`]: what every mission must keep.
//! - [`waste`]: the hazardous waste clean-up. [`service`]: points of work. [`push`]: long bars. [`observe`]: moving targets.

mod districts;
pub mod observe;
pub mod push;
mod registry;
pub mod service;
pub mod testkit;
pub mod waste;

pub use registry::{MissionParts, Registry};
