//! Ctrl-C, for commands that do their work in this process.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::runtime::Runtime;
use tokio::signal::unix::{SignalKind, signal};

use crate::runtime;

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
        let runtime = runtime::start()?;
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
