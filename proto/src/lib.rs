//! What crosses the bus between world-server and robot-agents, and what is written down of a run (DESIGN §2, §3, §8).
//!
//! - [`ids`], [`time`]: robots by rank, tasks, sets, ticks, simulated time in ms.
//! - [`tick`]: the lockstep, [`TickMessage`](tick::TickMessage) out and [`Report`](tick::Report) back, with [`readings`]
//!   and [`telemetry`] inside; [`join`]: the handshake before it.
//! - [`mission`]: what only one mission senses and does. [`team`]: what robots tell each other; [`allocation`]: what their
//!   allocators do.
//! - [`process`]: the agents' processes, which the launcher owns; [`os_process`]: what the system says of one; [`view`], [`event`]: what observers see.
//! - [`fault`]: what can go wrong, in one vocabulary; [`link`], [`links`]: what it does to messages; [`control`]: commands to a run.
//! - [`scenario`]: what a run is made of; [`mission`]: what missions add to it; [`log`]: what it leaves on the disk.
//! - [`keys`], [`codec`], [`session`], [`rendezvous`]: key expressions, bytes, zenoh settings, where a live run is found.
//! - [`locator`]: where somebody is reached over a network; [`key_files`], [`keyring`]: the keys of one member where the team is on several machines; [`secret`]: who may speak; [`ignored`]: the count of what is not listened to.
//! - [`terminal`]: what a command says to whoever started it; [`panics`]: what it says when it panics.
//! - [`testkit`]: a mission for tests of what knows none.
//! - [`rng`]: one stream of random numbers per purpose and robot.
//!
//! A release builds this crate at level 1, for most of it reads and writes files. What a step calls is marked `inline`, and so compiled
//! at level 3 by the crates that call it.

pub mod access;
pub mod allocation;
pub mod codec;
pub mod control;
pub mod enlist;
pub mod event;
pub mod fault;
pub mod ids;
pub mod ignored;
pub mod join;
pub mod key_files;
pub mod keyring;
pub mod keys;
pub mod link;
pub mod links;
pub mod locator;
pub mod log;
pub mod member;
pub mod mission;
mod obstacle;
pub mod os_process;
pub mod panics;
pub mod process;
pub mod readings;
pub mod rendezvous;
pub mod rng;
pub mod scenario;
pub mod secret;
pub mod session;
pub mod team;
pub mod telemetry;
pub mod terminal;
pub mod testkit;
pub mod tick;
pub mod time;
pub mod view;
#[cfg(test)]
mod view_types;
