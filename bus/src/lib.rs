//! Functions that open sessions on the bus, with readable errors.
//!
//! The crate exists to keep builds short. Zenoh's code for opening a session is generic, and each calling crate would
//! compile its own copy. Therefore the functions here are not generic.

mod handshake;
mod once;

use std::future::Future;
use std::pin::Pin;

use zenoh::{Config, Session};

pub use handshake::ConnectError;
pub use once::open_once;

/// Opens a session with a configuration in JSON5.
pub fn open(config: &str) -> Pin<Box<dyn Future<Output = zenoh::Result<Session>> + Send>> {
    let config = Config::from_json5(config);
    Box::pin(async { zenoh::open(config?).await })
}
