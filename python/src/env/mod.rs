//! Learning environments: runs that are stepped from outside, with external decisions for some robots.
//!
//! - [`world`]: one environment. [`external_agent`]: the allocator of an externally controlled robot. [`features`]: the
//!   observations.
//! - [`part`]: the environments of a batch that one of its [`threads`] steps. [`worlds`]: the batch, as a Python class.

mod external_agent;
mod features;
mod part;
mod threads;
mod world;
mod worlds;

pub use worlds::EnvironmentBatch;
