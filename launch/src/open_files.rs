//! How many files this process and those that it starts may have open.

use anyhow::{Context, bail};
use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// What a process needs, whatever it does: its log, the bus and its threads.
const AT_LEAST: u64 = 64;

/// Of the launcher for a robot's process, and of the world for its connection.
const FOR_EACH_ROBOT: u64 = 2;

/// Raises the limit as far as it goes without asking anybody, as what a large team needs is more than what shells begin with.
///
/// # Errors
/// When it is too low for so many robots: zenoh and tokio would panic later.
pub fn allow(robots: usize) -> anyhow::Result<()> {
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).context("limit of open files")?;
    let needed = AT_LEAST + FOR_EACH_ROBOT * robots as u64;
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
