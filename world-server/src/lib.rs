//! The world-server: physics, sensing and the step clock, and the process they live in.
//!
//! Pure, from the inside out:
//! - [`world`]: components, movement, sensors. [`mission`]: what robots are there for.
//! - [`interruption`]: what changes the world from outside.
//! - [`faults`]: when they begin and end, and what they make of readings and commands.
//! - [`barrier`]: who takes part in a tick, which reports count, who hears what.
//! - [`simulation`]: world and barrier together, a run tick by tick.
//! - [`recorder`]: the run's log and hash.
//!
//! The shell: [`server`] is a run behind one lock, [`process`] puts it on the bus and on the disk at a [`pace`], [`latest`] leads to it, [`args`] and [`size`] are its
//! command line. [`gateway`] is another process, where operators come in.

// They panic where nothing can be written; `alliance_proto::terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod args;
pub mod barrier;
#[cfg(test)]
mod drill;
pub mod error;
pub mod faults;
pub mod gateway;
pub mod interruption;
pub mod invocation;
pub mod latest;
pub mod mission;
pub mod network;
pub mod pace;
pub mod process;
pub mod recorder;
pub mod router;
pub mod server;
pub mod simulation;
pub mod size;
pub mod world;
