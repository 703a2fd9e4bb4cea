//! Learning environments: runs that are stepped from outside, with external decisions for some robots.
//!
//! - [`common`]: what all environments of a batch share. [`world`]: one environment.
//! - [`external_agent`]: the allocator of an externally controlled robot. [`features`]: the observations.
//! - [`part`]: the environments of a batch that one of its [`threads`] steps. [`worlds`]: the batch, as a Python class.
//! - [`snapshot`]: copies of environments in mid-episode.
//! - [`shaping`]: terms of the reward.
//! - [`memory`]: the check that a batch fits.

mod common;
mod external_agent;
mod features;
mod interrupt;
mod memory;
mod part;
mod shaping;
mod snapshot;
mod threads;
mod world;
mod worlds;

pub use features::BOUND;
pub use snapshot::EnvironmentStates;
pub use worlds::EnvironmentBatch;
