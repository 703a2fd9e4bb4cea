//! The missions: the only crate that contains mission-specific data, world models and robot controllers.
//!
//! - [`Registry`]: the missions and allocators of a program. [`testkit`]: the checks that every mission must pass.
//! - [`Randomised`]: starts and places that are drawn from the seed.
//! - [`waste`]: hazardous waste clean-up. [`service`]: points of work. [`push`]: long bars. [`observe`]: moving
//!   targets.
//! - [`external`]: readings and actions in a form for controllers in other languages.

/// Lists built-in scenarios of a mission: the files of these names in the folder `scenarios` beside the one of the caller.
macro_rules! builtin_scenarios {
    ($($name:literal),* $(,)?) => {
        [$(scenario::mission::data::BuiltinScenario {
            name: $name,
            text: include_str!(concat!("../scenarios/", $name, ".toml")),
        }),*]
    };
}

mod coverage;
mod districts;
mod duration;
pub mod external;
#[cfg(test)]
mod fixtures;
mod geometry;
pub mod observe;
pub mod push;
mod randomise;
mod registry;
pub mod service;
pub mod testkit;
#[cfg(test)]
mod tests;
pub mod waste;

pub use randomise::Randomised;
pub use registry::{MissionParts, Registry};
