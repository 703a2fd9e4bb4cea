//! Learning environments: runs that are stepped from outside, in which some robots do what somebody else decides.
//!
//! - [`world`]: one environment. [`puppet`]: the allocator of a robot that is told what to do. [`features`]: what learners see.
//! - [`part`]: some of a batch of them, for one of its [`threads`]. [`worlds`]: the batch, as Python has it.

mod features;
mod part;
mod puppet;
mod threads;
mod world;
mod worlds;

pub use worlds::Worlds;
