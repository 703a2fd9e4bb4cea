//! Functions that open sessions on the bus, with readable errors.
//!
//! The crate exists to keep builds short. Zenoh's code for opening a session is generic, and each calling crate would
//! compile its own copy. Therefore the functions here are not generic.

pub mod access;
#[cfg(test)]
mod certificate_tests;
pub mod certificates;
pub mod file;
mod handshake;
#[cfg(test)]
mod handshake_tests;
pub mod host_router;
pub mod key_files;
pub mod keyring;
pub mod locator;
pub mod member;
pub mod network;
pub mod os_process;
pub mod remote;
pub mod rendezvous;
pub mod router;
pub mod session;
mod single_attempt;
pub mod start;
pub mod store;
pub mod team;
#[cfg(test)]
mod test_scenarios;

use std::future::Future;
use std::pin::Pin;

use zenoh::{Config, Session};

pub use handshake::ConnectError;
pub use single_attempt::open_once;

/// Opens a session with a configuration in JSON5.
pub fn open(config: &str) -> Pin<Box<dyn Future<Output = zenoh::Result<Session>> + Send>> {
    let config = Config::from_json5(config);
    Box::pin(async { zenoh::open(config?).await })
}
