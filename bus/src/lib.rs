//! Sessions on the bus: how each program opens one, and why it could not.
//!
//! A crate of its own to keep builds short: zenoh's code for opening a session is generic, and each crate that calls it would compile
//! its own copy. So the functions here are not generic.

mod handshake;
mod once;

use std::future::Future;
use std::pin::Pin;

use zenoh::{Config, Session};

pub use handshake::ConnectError;
pub use once::open_once;

/// A session by that configuration, in JSON5.
///
/// # Errors
/// What zenoh says.
pub fn open(config: &str) -> Pin<Box<dyn Future<Output = zenoh::Result<Session>> + Send>> {
    let config = Config::from_json5(config);
    Box::pin(async { zenoh::open(config?).await })
}
