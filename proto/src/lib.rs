//! What crosses the bus between world-server and robot-agents, and nothing else (DESIGN §2, §3).
//!
//! - [`ids`], [`time`]: robots by rank, tasks, sets, ticks, simulated time in ms.
//! - [`tick`]: the lockstep, [`TickMessage`](tick::TickMessage) out and [`Report`](tick::Report) back, with [`readings`]
//!   and [`telemetry`] inside; [`join`]: the handshake before it.
//! - [`team`]: what robots tell each other.
//! - [`process`]: the agents' processes, which the launcher owns; [`view`], [`event`]: what observers see.
//! - [`fault`]: what can go wrong, in one vocabulary; [`link`]: what it does to messages; [`control`]: commands to a run.
//! - [`scenario`]: what a run is made of.
//! - [`keys`], [`codec`], [`session`], [`rendezvous`]: key expressions, bytes, zenoh settings, where a live run is found.
//! - [`secret`]: who may speak; [`ignored`]: the count of what is not listened to.
//! - [`terminal`]: what a command says to whoever started it.
//! - [`rng`]: one stream of random numbers per purpose and robot.

pub mod codec;
pub mod control;
pub mod event;
pub mod fault;
pub mod ids;
pub mod ignored;
pub mod join;
pub mod keys;
pub mod link;
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
pub mod tick;
pub mod time;
pub mod view;
