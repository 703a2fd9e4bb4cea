//! The robot-agent: one robot's mind, and the process it lives in.
//!
//! Pure, from the outside in:
//! - [`agent`]: one step of the mind. What has arrived in [`radio`] it hears through [`links`]; it perceives and acts through its mission, and weighs its
//!   motivations with [`alliance`].
//! - [`alliance`]: motivational behaviors, comm history, heartbeats (ALLIANCE.md).
//! - [`missions`]: behavior sets and knowledge.
//! - [`roster`]: names and ids.
//! - [`body`]: driving and obstacle avoidance.
//! - `by_rank`: lists of what is kept of each teammate.
//!
//! The shell: [`process`] puts an agent on the bus, [`args`] is its command line.

// They panic where nothing can be written; `alliance_proto::terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod agent;
pub mod alliance;
pub mod args;
pub mod body;
mod by_rank;
pub mod links;
pub mod missions;
pub mod process;
pub mod radio;
pub mod roster;
