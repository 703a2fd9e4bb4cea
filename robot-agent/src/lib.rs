//! The robot agent: the controller of one robot, and the process that runs it.
//!
//! Pure modules, from the outside in:
//! - [`agent`]: one step of the controller. It receives broadcasts through [`link`](proto::link), perceives and acts through its mission, and selects a behavior with its
//!   allocator.
//! - [`allocator`]: the interface of task allocation algorithms; [`allocators`]: the built-in algorithms, ALLIANCE
//!   among them.
//! - [`mission`]: the interface of missions on the robots' side.
//! - [`body`]: driving and obstacle avoidance.
//! - [`testkit`]: conformance tests for allocators, also for other crates.
//! - [`by_rank`]: lists of values per teammate. [`broken`]: rules broken on purpose, for tests.
//!
//! The shell with side effects: [`process`] connects an agent to the bus, and [`args`] is the
//! command line. Both need the feature `bus`. [`registry`] contains the allocators and missions of a program.

// The print macros panic on a closed stream; `terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod agent;
pub mod allocator;
pub mod allocators;
#[cfg(feature = "bus")]
pub mod args;
pub mod body;
pub mod broken;
pub mod by_rank;
#[cfg(test)]
mod fixtures;
pub mod mission;
#[cfg(feature = "bus")]
pub mod process;
pub mod registry;
pub mod testkit;
