//! What the robots of a run have learned by its end, for the next one: `alliance run --profile`.
//!
//! It is no part of the log, as it follows from it: the run is made again from its inputs, and its robots are asked. So it is the same
//! whether they were processes or not.

use std::io::Write;
use std::path::Path;

use alliance_proto::log::{LogLevel, RunLog};
use alliance_proto::scenario::Profile;
use anyhow::{Context, bail};

use crate::new_file::NewFile;
use crate::replay::team_at_end;

/// Whether a profile can be written there; an older one stays as it is.
///
/// # Errors
/// When it cannot.
pub fn check_place(path: &Path) -> anyhow::Result<()> {
    NewFile::create(path).map(drop)
}

/// Writes what the robots of a logged run have learned. An older file stays until the new one is whole.
///
/// # Errors
/// Those of [`learned`]; when the file cannot be written.
pub fn write_profile(path: &Path, logged: &RunLog) -> anyhow::Result<()> {
    let text = learned(logged)?.to_toml();
    let mut file = NewFile::create(path)?;
    let mut writer = file.writer();
    writer.write_all(text.as_bytes())?;
    writer.flush()?;
    drop(writer);
    file.put_in_place()
}

/// What the robots of a logged run have learned by its end.
///
/// # Errors
/// When the run cannot be made again, or comes out otherwise.
pub fn learned(logged: &RunLog) -> anyhow::Result<Profile> {
    let (team, outcome) =
        team_at_end(logged, LogLevel::Off, |_| {}).context("what the robots have learned")?;
    let profile = team.learned();
    let (again, _) = team.end(outcome)?;
    if again.hash != logged.run.hash {
        bail!(
            "what the robots have learned is not known, for the run does not repeat; `alliance replay` says where"
        );
    }
    Ok(profile)
}
