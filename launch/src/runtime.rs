//! The runtime of every part of the command that speaks over the bus.

use anyhow::Context;
use tokio::runtime::{Builder, Runtime};

/// Zenoh refuses a scheduler on the current thread; one worker is all there is to do for.
///
/// # Errors
/// When the operating system gives no thread.
pub fn start() -> anyhow::Result<Runtime> {
    Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .context("starting the runtime")
}
