//! The robot-agent: one robot's mind, and the process it lives in.
//!
//! Pure, from the outside in:
//! - [`agent`]: one step of the mind. What has arrived in [`radio`] it hears through [`links`](alliance_proto::links); it perceives and acts through its mission, and weighs its
//!   choices with its allocator.
//! - [`allocator`]: the seam to the rule that chooses; [`allocators`]: the rules, ALLIANCE among them.
//! - [`mission`]: the seam to what robots are there for.
//! - [`body`]: driving and obstacle avoidance.
//! - [`testkit`]: what every allocator must keep, for tests of other crates too.
//! - [`by_rank`]: lists of what is kept of each teammate.
//!
//! The shell: [`process`] puts an agent on the bus, [`far`] finds a run on another host, [`args`] is its command line.

// They panic where nothing can be written; `alliance_proto::terminal` does not.
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
