//! Ctrl-C handling for commands that do their work in this process.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{SignalKind, signal};

/// The exit status of a command that a signal has ended, as shells report it for Ctrl-C.
pub const INTERRUPTED_STATUS: u8 = 130;

/// The error of a command that a signal has ended. The command has already printed how to continue.
#[derive(Debug, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// A flag that is set when the process receives SIGINT or SIGTERM.
pub struct InterruptFlag {
    requested: Arc<AtomicBool>,
    /// The runtime of the signal handlers, kept alive with the flag.
    _runtime: Runtime,
}

impl InterruptFlag {
    /// Installs handlers for SIGINT and SIGTERM.
    ///
    /// # Errors
    /// Returns an error when the operating system refuses.
    pub fn install() -> anyhow::Result<Self> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .context("starting the runtime")?;
        let requested = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&requested);
        let (mut interrupt, mut terminate) = runtime.block_on(async {
            let interrupt = signal(SignalKind::interrupt())?;
            signal(SignalKind::terminate()).map(|terminate| (interrupt, terminate))
        })?;
        runtime.spawn(async move {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            flag.store(true, Ordering::Relaxed);
        });
        Ok(Self {
            requested,
            _runtime: runtime,
        })
    }

    /// Returns whether a signal has arrived.
    pub fn is_set(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }
}
