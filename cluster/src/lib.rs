//! Sessions on the bus, on one machine and on several.
//!
//! - [`open`], [`open_once`]: open a session, with readable errors. Zenoh's code for this is generic; functions without
//!   type parameters compile it once, for all programs.
//! - [`session`]: the configuration of zenoh. [`router`]: the routers of a run. [`access`]: what each member may send.
//! - [`rendezvous`], [`member`]: how a process finds a run on this machine, and its login.
//! - [`ignored`]: counts of messages that a process could not use.
//! - [`network`], [`remote`], [`host_router`]: a world that listens on a network, and hosts that connect to it.
//! - [`file`](mod@file), [`team`], [`certificates`], [`keyring`]: cluster files, and the keys of a team.

pub mod access;
#[cfg(test)]
mod certificate_tests;
pub mod certificates;
pub mod file;
mod handshake;
#[cfg(test)]
mod handshake_tests;
pub mod host_router;
pub mod ignored;
pub mod key_files;
pub mod keyring;
pub mod locator;
pub mod member;
pub mod network;
pub mod os_process;
pub mod process_log;
pub mod remote;
pub mod rendezvous;
pub mod router;
pub mod session;
mod silence;
mod single_attempt;
pub mod start;
pub mod store;
pub mod team;
#[cfg(test)]
mod tests;

use std::future::Future;
use std::pin::Pin;

use zenoh::{Config, Session};

pub use handshake::ConnectError;
pub use single_attempt::{open_once, try_open};

/// Opens a session with a configuration in JSON5.
pub fn open(config: &str) -> Pin<Box<dyn Future<Output = zenoh::Result<Session>> + Send>> {
    let config = Config::from_json5(config);
    Box::pin(async { zenoh::open(config?).await })
}
