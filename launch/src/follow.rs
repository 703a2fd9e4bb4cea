//! A process that follows the log of a live run until the run is over.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use analysis::live::{Follower, LiveRun, Progress};
use anyhow::{bail, ensure};
use run_log::{Document, ReadError};
use scenario::Problem;
use terminal::fail;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::sleep;
use world_server::gateway::lower_priority;

use crate::runtime;

/// The interval between readings of the log. The world writes it every 100 ms.
const INTERVAL: Duration = Duration::from_millis(20);

/// A run to follow.
pub struct FollowedRun {
    pub folder: PathBuf,
    /// `true` to follow the run from its start, and to wait for its folder.
    pub from_start: bool,
    /// The option that starts such a process, for error messages.
    pub option: &'static str,
}

/// Runs the work of a process. Returns its exit status: 2 if the run cannot be followed, and 3 for other errors.
pub fn run(name: &str, work: impl Future<Output = anyhow::Result<()>>) -> ExitCode {
    let done = runtime::start_runtime().and_then(|runtime| {
        let done = runtime.block_on(work);
        // A thread that waits for a connection does not end by itself.
        runtime.shutdown_background();
        done
    });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let no_run = |error: &ReadError| matches!(error, ReadError::NoRun { .. });
            let is_refused =
                error.is::<Problem>() || error.downcast_ref::<ReadError>().is_some_and(no_run);
            fail(name, &error, if is_refused { 2 } else { 3 })
        }
    }
}

impl FollowedRun {
    /// Opens the log of the run. Returns `None` after a request to end.
    ///
    /// # Errors
    /// Returns an error if the run cannot be followed, or if it is over and would be followed from now on.
    pub async fn open(&self, ends: &mut EndRequests) -> anyhow::Result<Option<LiveRun>> {
        let folder = &self.folder;
        if self.from_start && ends.during(start_of(folder)).await.is_none() {
            return Ok(None);
        }
        let run = LiveRun::open(folder, self.option)?;
        if run.has_ended() && !self.from_start {
            let place = folder.display().to_string();
            bail!(Problem::with_source(
                place,
                "the run is over",
                "use `alliance export`"
            ));
        }
        Ok(Some(run))
    }
}

/// Waits until the folder contains a run.
async fn start_of(folder: &Path) {
    while !folder.join(Document::Run.file_name()).exists() {
        sleep(INTERVAL).await;
    }
}

/// Waits for work. Returns `None` if the run ends before.
pub async fn while_live<T>(
    run: &mut LiveRun,
    work: impl Future<Output = T>,
) -> anyhow::Result<Option<T>> {
    tokio::pin!(work);
    loop {
        tokio::select! {
            done = &mut work => return Ok(Some(done)),
            () = sleep(INTERVAL) => {
                run.read_outcome()?;
                if run.has_ended() {
                    return Ok(None);
                }
            }
        }
    }
}

/// Shows a run to a follower until it is over, or until a request to end. `caught_up` is called when the follower has the
/// present state of the run.
///
/// The process gets a lower priority, because it repeats the run and would take time from the team at full speed.
///
/// # Errors
/// Returns the errors of the log and of the follower. Returns an error if the run is over at a request to end, and the
/// follower has not seen all of it.
pub async fn follow<F: Follower>(
    run: &mut LiveRun,
    follower: &mut F,
    ends: &mut EndRequests,
    mut caught_up: impl FnMut(&mut F),
) -> anyhow::Result<()> {
    lower_priority();
    loop {
        let progress = run.advance(follower)?;
        if progress != Progress::More {
            caught_up(follower);
        }
        let pause = match progress {
            Progress::More => Duration::ZERO,
            Progress::UpToDate => INTERVAL,
            Progress::Over => return Ok(()),
        };
        if ends.during(sleep(pause)).await.is_none() {
            run.read_outcome()?;
            // The launcher ends a process that is too late. Its clients lack the rest of the run.
            ensure!(
                !run.has_ended(),
                "the process was ended before it had published the whole run"
            );
            return Ok(());
        }
    }
}

/// The signals that request the end of this process.
pub struct EndRequests {
    interrupt: Signal,
    terminate: Signal,
}

impl EndRequests {
    /// Begins to receive requests to end.
    pub fn new() -> anyhow::Result<Self> {
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
        })
    }

    /// Waits for work. Returns `None` after a request to end.
    pub async fn during<T>(&mut self, work: impl Future<Output = T>) -> Option<T> {
        tokio::select! {
            biased;
            _ = self.interrupt.recv() => None,
            _ = self.terminate.recv() => None,
            done = work => Some(done),
        }
    }
}
