//! The values that a run's robots have learned by its end, for the next run: `alliance run --profile`.
//!
//! The profile is not part of the log because it follows from the log. The run is replayed from its inputs, and the
//! robots' values are read at the end. The result is the same for robots with and without processes of their own.

use std::path::Path;

use anyhow::{Context, bail};
use run_log::{LogLevel, MemoryLog, RunLog};
use scenario::Profile;

use crate::new_file::{NewFile, write_atomically};
use crate::replay::team_at_end;

/// Checks that a profile can be written to `path`. An older file remains unchanged.
///
/// # Errors
/// Returns an error when it cannot be written.
pub fn check_writable(path: &Path) -> anyhow::Result<()> {
    NewFile::create(path).map(drop)
}

/// Writes the learned values of a logged run. An older file remains until the new one is complete.
///
/// # Errors
/// Returns the errors of `learned`, or an error when the file cannot be written.
pub fn write_profile(path: &Path, logged: &RunLog) -> anyhow::Result<()> {
    write_atomically(path, learned_profile(logged)?.to_toml().as_bytes())
}

/// Returns the values that the robots of a logged run have learned by its end.
///
/// # Errors
/// Returns an error when the run cannot be replayed or the replay differs.
pub fn learned_profile(logged: &RunLog) -> anyhow::Result<Profile> {
    let (team, outcome) = team_at_end(logged, LogLevel::Off, MemoryLog::default(), |_| {})
        .context("reading the learned values")?;
    let profile = team.learned();
    let (again, _) = team.end(outcome)?;
    if again.hash != logged.run.hash {
        bail!(
            "the learned values are unknown because the replay differs from the run; `alliance replay` shows where"
        );
    }
    Ok(profile)
}
