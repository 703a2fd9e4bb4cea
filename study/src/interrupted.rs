//! Ctrl-C, for commands that do their work in this process.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{SignalKind, signal};

/// Whether somebody has asked this process to end.
pub struct Interrupted {
    asked: Arc<AtomicBool>,
    /// Keeps the ears open.
    _runtime: Runtime,
}

impl Interrupted {
    /// Listens for SIGINT and SIGTERM from now on.
    ///
    /// # Errors
    /// When the operating system does not let it.
    pub fn watch() -> anyhow::Result<Self> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .context("starting the runtime")?;
        let asked = Arc::new(AtomicBool::new(false));
        let mark = Arc::clone(&asked);
        let (mut interrupt, mut terminate) = runtime.block_on(async {
            let interrupt = signal(SignalKind::interrupt())?;
            signal(SignalKind::terminate()).map(|terminate| (interrupt, terminate))
        })?;
        runtime.spawn(async move {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            mark.store(true, Ordering::Relaxed);
        });
        Ok(Self {
            asked,
            _runtime: runtime,
        })
    }

    /// Whether one has come.
    pub fn is_so(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }
}
