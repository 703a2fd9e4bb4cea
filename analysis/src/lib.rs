//! Analysis of recorded runs: replay, invariant checks, comparison, reports and export.
//!
//! - [`replay`]: the repetition of a run from its log. [`learned`]: the values that its robots have learned. [`diff`]:
//!   the first difference of two runs. [`replay_views`]: a finished run with a view of each tick.
//! - [`branch`]: a run that repeats another one up to a tick. [`allocation`]: communication rounds without motion.
//! - [`report`]: figures and metrics of a run. [`export`]: a run for other tools, and as pictures and films.
//! - `ros_messages`: a run as messages of ROS 2. `foxglove_messages`: a run as messages for Foxglove. `live`: a live run,
//!   from its growing log, for observers of other tools.
//! - [`instance`]: instances of other programs as scenarios, and runs as instances.
//! - [`sweep`]: many runs and their statistics. [`compare`]: allocators under faults. [`random_mission`]: random
//!   missions for sweeps. [`invariants`]: conditions that every run must satisfy.
//! - [`controllers`]: controllers in Python that a plan names. [`tune`]: parameter search for allocators.
//! - [`hunt`]: search for faults that break allocators. [`mod@bench`]: suites that never change, and the check of a result.
//! - [`strategies`]: L-ALLIANCE's strategies against the optimum. [`shell`]: words of printed commands.
//! - [`check`]: the effective parameters of a scenario, before a run. [`table`]: tables in a terminal. [`progress`]: the
//!   display of long work.
//!
//! [`run_log`] reads the logs. Each module contains the `alliance` subcommand that belongs to it.

pub mod allocation;
mod batch_journal;
pub mod bench;
pub mod branch;
pub mod check;
mod columns;
pub mod compare;
pub mod controllers;
pub mod diff;
pub mod export;
mod figures;
#[cfg(feature = "mcap")]
pub mod foxglove_messages;
pub mod hunt;
pub mod instance;
pub mod interrupted;
pub mod invariants;
pub mod learned;
#[cfg(any(feature = "mcap", feature = "rosbag"))]
pub mod live;
mod new_file;
pub mod optional;
mod page;
mod picture;
pub mod progress;
pub mod random_mission;
pub mod replay;
pub mod replay_views;
pub mod report;
#[cfg(feature = "rosbag")]
pub mod ros_messages;
pub mod shell;
pub mod strategies;
pub mod sweep;
pub mod table;
#[cfg(test)]
mod testkit;
pub mod tune;
#[cfg(test)]
mod visit;
mod workers;

pub use figures::palette;
pub use figures::pixels::Pixels;
pub use picture::live::draw_view;

use std::fs::Metadata;
use std::path::Path;
use std::process::ExitCode;

use indicatif::DecimalBytes;
use interrupted::{INTERRUPTED_STATUS, Interrupted};
use missions::Registry;
use run_log::{RunLog, RunOutcome};
use scenario::Problem;
use terminal::{fail, stderr_line};

/// The link to the newest run: the folder that commands use by default.
pub const LATEST: &str = "runs/latest";

/// Returns the items without repetitions, in the order of their first occurrence.
fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for item in items {
        if !found.contains(&item) {
            found.push(item);
        }
    }
    found
}

/// Opens the log in the folder of a run.
///
/// # Errors
/// Fails if the folder contains no run. Before the first run, the message of [`LATEST`] names the way to one.
fn open(folder: &Path) -> anyhow::Result<RunLog> {
    open_within(folder, u64::MAX)
}

/// Opens the log like [`open`], without the tables of every tick if they are larger than `bytes_max`.
fn open_within(folder: &Path, bytes_max: u64) -> anyhow::Result<RunLog> {
    if folder == Path::new(LATEST) && !folder.exists() {
        let remedy = "start one with `alliance run`, or name the folder of a run";
        return Err(Problem::with_source(LATEST, "there is no run here yet", remedy).into());
    }
    announce_reading(folder);
    let vocabulary = Registry::current().vocabulary();
    Ok(RunLog::open_within(folder, &vocabulary, bytes_max)?)
}

/// The size of the tables of every tick up to which they are read to show a run. A report of a simulated day of a small team
/// needs four to five times as much memory, which stays below 1 GB.
const SHOWN_BYTES_MAX: u64 = 200_000_000;

/// The size of a log that is read without a word. It takes well below a second.
const SILENT_BYTES: u64 = 32_000_000;

/// Writes a line about a log whose reading takes time.
pub fn announce_reading(folder: &Path) {
    if let Some(line) = about_reading(folder) {
        stderr_line!("{line}");
    }
}

/// Returns a line about a log whose reading takes time.
fn about_reading(folder: &Path) -> Option<String> {
    let is_file = |file: &Metadata| file.is_file();
    let entries = folder.read_dir().ok()?;
    let files = entries.filter_map(|entry| entry.ok()?.metadata().ok().filter(is_file));
    let bytes: u64 = files.map(|file| file.len()).sum();
    let size = DecimalBytes(bytes);
    (bytes > SILENT_BYTES).then(|| format!("reading {} ({size})", folder.display()))
}

/// Opens the log of a run to show it, without the tables of every tick if they are larger than `bytes_max`. A damaged log
/// would show a run that ends too early.
///
/// # Errors
/// Fails like [`open`], and if the run has ended and its log does not contain all of it.
fn open_undamaged(folder: &Path, bytes_max: u64) -> anyhow::Result<RunLog> {
    let log = open_within(folder, bytes_max)?;
    match log.damage() {
        None => Ok(log),
        Some(damage) => {
            let (run, what) = (folder.display().to_string(), damage.to_string());
            let remedy = "restore the file; `alliance replay` names the first difference";
            Err(Problem::with_source(run, what, remedy).into())
        }
    }
}

/// Opens the log of a finished run to show it. Returns `None` for a run in progress, or whose world was killed.
///
/// # Errors
/// Fails if the folder contains no run, and if the run has ended and its log does not contain all of it.
pub fn open_finished(folder: &Path) -> anyhow::Result<Option<RunLog>> {
    let log = open_undamaged(folder, u64::MAX)?;
    Ok((log.run.outcome != RunOutcome::Running).then_some(log))
}

/// Returns the exit status of a command. Writes an error to stderr; its status is `on_error`, or 130 after an
/// interruption, which the command has already reported.
fn exit_status(command: &str, done: anyhow::Result<ExitCode>, on_error: u8) -> ExitCode {
    done.unwrap_or_else(|error| {
        if error.is::<Interrupted>() {
            return ExitCode::from(INTERRUPTED_STATUS);
        }
        fail(&format!("alliance {command}"), &error, on_error)
    })
}

/// Returns status 0 if all is done, and 1 otherwise.
fn all_done(is_done: bool) -> ExitCode {
    ExitCode::from(u8::from(!is_done))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_log_is_announced_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = std::fs::File::create(folder.path().join("poses.csv")).unwrap();
        file.set_len(SILENT_BYTES).unwrap();
        assert_eq!(about_reading(folder.path()), None);
        file.set_len(40 * SILENT_BYTES).unwrap();
        let line = about_reading(folder.path()).unwrap();
        assert!(line.ends_with(" (1.28 GB)"), "{line}");
    }

    #[test]
    fn without_a_run_the_message_names_the_way_to_one() {
        // Tests run in the folder of this crate, which contains no runs.
        let refused = open(Path::new(LATEST)).unwrap_err();
        assert_eq!(
            format!("{refused:#}"),
            "runs/latest: there is no run here yet; start one with `alliance run`, or name the folder of a run"
        );
    }
}
