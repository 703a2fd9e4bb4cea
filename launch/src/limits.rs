//! Limits of the operating system for open files and threads.

use std::sync::{Arc, Mutex};
use std::thread::Builder;

use anyhow::{Context, bail};
use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// The number of files that every process needs: log, bus and threads.
const FILES: u64 = 64;
/// The number of files per robot, in the launcher for its process and in the world for its connection.
const FILES_FOR_EACH_ROBOT: u64 = 2;
/// The number of threads of a process in a run.
const THREADS: usize = 5;
/// The number of processes besides the agents: launcher, world, gateway, page.
const PROCESSES: usize = 4;
/// The stack size of a test thread in bytes.
const STACK: usize = 16 << 10;

/// Checks that this process has enough files and threads. Raises the soft limit of open files to the hard limit, because large teams
/// need more than the default of shells.
///
/// # Errors
/// If there are too few files or threads. Without this check zenoh and tokio would panic later.
pub fn check_process_limits() -> anyhow::Result<()> {
    allow_files(FILES)?;
    allow_threads(THREADS)
}

/// Checks that a run by processes with this number of robots has enough files and threads.
pub fn check_run_limits(robots: usize) -> anyhow::Result<()> {
    allow_files(FILES + FILES_FOR_EACH_ROBOT * robots as u64)?;
    allow_threads(THREADS * (PROCESSES + robots))
}

fn allow_files(needed: u64) -> anyhow::Result<()> {
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).context("limit of open files")?;
    if hard < needed {
        bail!(
            "{needed} open files are required, but the system allows only {hard}; raise the hard limit, for example with `ulimit -n {needed}`"
        );
    }
    if soft < hard {
        setrlimit(Resource::RLIMIT_NOFILE, hard, hard).context("limit of open files")?;
    }
    Ok(())
}

/// Starts test threads. The limits alone are not sufficient: a user's limit includes other processes, and a container has its own.
fn allow_threads(needed: usize) -> anyhow::Result<()> {
    let wait = Arc::new(Mutex::new(()));
    let held = wait.lock();
    let mut threads = Vec::with_capacity(needed);
    for started in 0..needed {
        let wait = Arc::clone(&wait);
        let thread = Builder::new()
            .stack_size(STACK)
            .spawn(move || drop(wait.lock()));
        match thread {
            Ok(thread) => threads.push(thread),
            Err(error) => bail!(
                "{needed} threads are required, but the system allows only {started} ({error}); raise `ulimit -u` or the container's limit of processes"
            ),
        }
    }
    drop(held);
    for thread in threads {
        // The thread cannot panic.
        let _ = thread.join();
    }
    Ok(())
}
