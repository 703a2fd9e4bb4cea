//! Learning environments: runs that are stepped from outside, in which some robots do what somebody else decides.
//!
//! - [`world`]: one environment. [`puppet`]: the allocator of a robot that is told what to do. [`features`]: what learners see.
//! - [`worlds`]: a batch of them, as Python has it.

mod features;
mod puppet;
mod world;
mod worlds;

pub use worlds::Worlds;
