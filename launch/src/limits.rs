//! How many files and threads the operating system lets a run have.

use std::sync::{Arc, Mutex};
use std::thread::Builder;

use anyhow::{Context, bail};
use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// Files that a process needs, whatever it does: its log, the bus and its threads.
const FILES: u64 = 64;
/// Of the launcher for a robot's process, and of the world for its connection.
const FILES_FOR_EACH_ROBOT: u64 = 2;
/// Threads that a process of a run has.
const THREADS: usize = 5;
/// Processes of a run beside the agents: launcher, world, gateway, page.
const PROCESSES: usize = 4;
/// Of a thread that is only to be there, bytes.
const STACK: usize = 16 << 10;

/// Whether this process can do its work. Raises the limit of files as far as it goes without asking anybody, as what a large team needs is
/// more than what shells begin with.
///
/// # Errors
/// When there are too few files or threads: zenoh and tokio would panic later.
pub fn allow_a_process() -> anyhow::Result<()> {
    allow_files(FILES)?;
    allow_threads(THREADS)
}

/// Whether a run by processes with so many robots can be.
///
/// # Errors
/// As for a process.
pub fn allow_a_run(robots: usize) -> anyhow::Result<()> {
    allow_files(FILES + FILES_FOR_EACH_ROBOT * robots as u64)?;
    allow_threads(THREADS * (PROCESSES + robots))
}

fn allow_files(needed: u64) -> anyhow::Result<()> {
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).context("limit of open files")?;
    if hard < needed {
        bail!(
            "{needed} open files are needed and {hard} allowed; `ulimit -n {needed}` allows them, where the system lets you"
        );
    }
    if soft < hard {
        setrlimit(Resource::RLIMIT_NOFILE, hard, hard).context("limit of open files")?;
    }
    Ok(())
}

/// Tries: a user's limit counts what else the user runs, and a container's stands elsewhere.
fn allow_threads(needed: usize) -> anyhow::Result<()> {
    let wait = Arc::new(Mutex::new(()));
    let held = wait.lock();
    let mut threads = Vec::with_capacity(needed);
    for made in 0..needed {
        let wait = Arc::clone(&wait);
        let thread = Builder::new()
            .stack_size(STACK)
            .spawn(move || drop(wait.lock()));
        match thread {
            Ok(thread) => threads.push(thread),
            Err(error) => bail!(
                "{needed} threads are needed and {made} can be had ({error}); `ulimit -u`, or a container's limit of processes, is too low"
            ),
        }
    }
    drop(held);
    for thread in threads {
        // It does nothing that could panic.
        let _ = thread.join();
    }
    Ok(())
}
