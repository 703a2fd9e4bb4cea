//! The asynchronous runtime of all commands that use the bus.

use anyhow::Context;
use tokio::runtime::{Builder, Runtime};

/// Starts a runtime with one worker thread. Zenoh refuses a scheduler on the current thread.
pub fn start_runtime() -> anyhow::Result<Runtime> {
    Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .context("starting the runtime")
}
