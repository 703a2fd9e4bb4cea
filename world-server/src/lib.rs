//! The world server: physics, sensing and the step clock, and the process that runs them.
//!
//! Pure modules, from the inside out:
//! - [`world`]: components, movement and sensors. [`mission`]: the world part of missions.
//! - [`interruption`]: changes of the world from outside.
//! - [`faults`]: begin and end of faults, and their effects on readings and commands.
//! - [`barrier`]: participants of a tick, counted reports and delivery lists.
//! - [`simulation`]: world and barrier together, one run tick by tick. [`pace`]: its speed.
//!
//! Modules with side effects: [`run_state`] is a run at the start of a tick, and [`server`] one behind a lock. [`process`] connects it to the bus and the disk.
//! [`latest`] links to it. [`args`] and [`size`] are its command line, and [`mission_args`] the arguments of a mission. [`weights`]
//! reads the files that a scenario names. [`gateway`] is a separate process that operators connect to. [`external_bodies`]: the
//! messages of the bridge to another world in which the bodies move; `bridge` connects a run to it.

// `println!` panics if the output is closed; `terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(feature = "bus")]
pub mod args;
pub mod barrier;
#[cfg(feature = "bus")]
mod bridge;
#[cfg(test)]
mod drill;
#[cfg(feature = "bus")]
pub mod error;
#[cfg(feature = "bus")]
pub mod external_bodies;
pub mod faults;
#[cfg(feature = "bus")]
pub mod gateway;
pub mod interruption;
pub mod invocation;
#[cfg(feature = "bus")]
pub mod latest;
#[cfg(feature = "bus")]
pub mod metrics;
pub mod mission;
pub mod mission_args;
pub mod pace;
#[cfg(feature = "bus")]
pub mod process;
#[cfg(feature = "bus")]
pub mod run_state;
#[cfg(feature = "bus")]
pub mod server;
pub mod simulation;
pub mod size;
pub mod weights;
pub mod world;
