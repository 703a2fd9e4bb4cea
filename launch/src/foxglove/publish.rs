//! The process that serves a run.

use std::process::ExitCode;
use std::time::Duration;

use analysis::foxglove_messages::LiveMessages;
use analysis::live;
use run_log::LogLevel;
use scenario::{Problem, Setup};
use terminal::stderr_line;

use super::channels::FoxgloveChannels;
use super::{FoxgloveCommand, OPTION};
use crate::follow::{self, EndRequests, FollowedRun, follow};

/// The time for clients to receive the last messages and to leave.
const DRAIN_TIME: Duration = Duration::from_secs(2);

/// Checks that a run can be served.
///
/// # Errors
/// Returns an error if the run cannot be followed.
pub fn check(setup: &Setup, log: LogLevel) -> Result<(), Problem> {
    live::check(setup, log, OPTION)
}

/// Serves a run. Returns the exit status.
pub fn run(name: &str, command: &FoxgloveCommand) -> ExitCode {
    follow::run(name, publish(command))
}

async fn publish(command: &FoxgloveCommand) -> anyhow::Result<()> {
    let mut ends = EndRequests::new()?;
    let followed = FollowedRun {
        folder: command.folder.clone(),
        from_start: command.from_start,
        option: OPTION,
    };
    let Some(mut run) = followed.open(&mut ends).await? else {
        return Ok(());
    };
    // A process that follows from now on keeps the past to itself.
    let channels = FoxgloveChannels::new(!command.from_start);
    let mut messages = LiveMessages::new(run.setup(), channels)?;
    let name = format!("alliance: {}", run.setup().scenario.name);
    let address = command.address;
    let control = command.control.as_deref();
    messages.channels.serve(name, address, control).await?;
    stderr_line!("{}", command.describe());
    let followed = follow(&mut run, &mut messages, &mut ends, |messages| {
        messages.channels.catch_up();
    });
    followed.await?;
    ends.during(messages.channels.close(DRAIN_TIME)).await;
    Ok(())
}
