//! Messages between the world server and the robot agents, and the file formats of a run.
//!
//! - [`ids`], [`time`]: ids of robots, tasks and behavior sets, ticks, and simulated time in ms.
//! - [`tick`]: the lockstep protocol, with [`TickMessage`](tick::TickMessage) to an agent and [`Report`](tick::Report)
//!   back. They contain [`readings`] and [`telemetry`]. [`join`]: the handshake before the first tick.
//! - [`mission`]: sensor readings and actions of one mission. [`team`]: messages between robots. [`allocation`]:
//!   actions of their allocators.
//! - [`process`]: the agents' processes, which the launcher owns. [`os_process`]: process data from the operating
//!   system. [`view`], [`event`]: data for observers.
//! - [`fault`]: the vocabulary of faults. [`link`], [`links`]: their effect on messages. [`control`]: commands to a
//!   run.
//! - [`scenario`]: the inputs of a run. [`log`]: the files of its run folder.
//! - [`keys`], [`codec`], [`session`], [`rendezvous`]: key expressions, encoding, zenoh settings, and the addresses of
//!   live runs.
//! - [`locator`]: network addresses. [`key_files`], [`keyring`]: the keys of one member of a team on several machines.
//!   [`secret`]: authentication of messages. [`ignored`]: counts of ignored messages.
//! - [`terminal`]: output of commands. [`panics`]: handling of panics.
//! - [`testkit`]: a mission for tests that need no particular one.
//! - [`rng`]: one stream of random numbers per purpose and robot.
//!
//! Release builds compile this crate at optimization level 1, because most of it reads and writes files. Functions that
//! a step calls are marked `inline`, so the calling crates compile them at level 3.

pub mod allocation;
pub mod codec;
pub mod control;
pub mod event;
pub mod identity;
pub mod ignored;
pub mod join;
pub mod keys;
pub mod link;
pub mod links;
pub mod membership;
pub mod mission;
#[cfg(test)]
mod page_types;
pub mod process;
pub mod readings;
pub mod secret;
pub mod team;
pub mod telemetry;
pub mod tick;
pub mod view;
