//! Replacement for `publish` in a program that is built without Foxglove. Its callers have refused the option already.

use std::process::ExitCode;

use run_log::LogLevel;
use scenario::{Problem, Setup};

use super::FoxgloveCommand;

/// Accepts every run, because nothing is served.
pub fn check(_: &Setup, _: LogLevel) -> Result<(), Problem> {
    Ok(())
}

/// Serves nothing, because the program lacks the feature.
pub fn run(_: &str, _: &FoxgloveCommand) -> ExitCode {
    ExitCode::from(2)
}
