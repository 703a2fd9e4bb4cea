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

/// A flag that is set when the process receives SIGINT or SIGTERM. A second signal ends the process at once.
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
            loop {
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = terminate.recv() => {}
                }
                if flag.swap(true, Ordering::Relaxed) {
                    std::process::exit(INTERRUPTED_STATUS.into());
                }
            }
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

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    use std::thread::yield_now;

    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    use super::*;

    /// Marks the process that waits for signals.
    const WAITS: &str = "ALLIANCE_TEST_WAITS_FOR_SIGNALS";

    #[test]
    fn a_second_signal_ends_a_process_that_is_busy() {
        if std::env::var_os(WAITS).is_some() {
            let flag = InterruptFlag::install().unwrap();
            println!("\nready");
            while !flag.is_set() {
                yield_now();
            }
            println!("set");
            loop {
                yield_now();
            }
        }
        let name = "interrupted::tests::a_second_signal_ends_a_process_that_is_busy";
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", name, "--nocapture"])
            .env(WAITS, "1")
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        for mark in ["ready", "set"] {
            let is_mark = |line: &std::io::Result<String>| line.as_deref().unwrap() == mark;
            assert!(lines.by_ref().any(|line| is_mark(&line)), "{mark}");
            kill(Pid::from_raw(child.id() as i32), Signal::SIGTERM).unwrap();
        }
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(INTERRUPTED_STATUS.into()));
    }
}
