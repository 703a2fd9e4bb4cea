//! The robot agent: the controller of one robot, and the process that runs it.
//!
//! Pure modules, from the outside in:
//! - [`agent`]: one step of the controller. It receives broadcasts from [`radio`] through
//!   [`links`](alliance_proto::links), perceives and acts through its mission, and selects a behavior with its
//!   allocator.
//! - [`allocator`]: the interface of task allocation algorithms; [`allocators`]: the built-in algorithms, ALLIANCE
//!   among them.
//! - [`mission`]: the interface of missions on the robots' side.
//! - [`body`]: driving and obstacle avoidance.
//! - [`testkit`]: conformance tests for allocators, also for other crates.
//! - [`by_rank`]: lists of values per teammate.
//!
//! The shell with side effects: [`process`] connects an agent to the bus, [`far`] finds a run on another host, and
//! [`args`] is the command line.

// The print macros panic on a closed stream; `alliance_proto::terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod agent;
pub mod allocator;
pub mod allocators;
pub mod args;
pub mod body;
pub mod by_rank;
pub mod far;
pub mod mission;
pub mod process;
pub mod radio;
pub mod testkit;
