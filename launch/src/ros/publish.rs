//! The process that publishes a run.

use std::process::ExitCode;
use std::time::Duration;

use analysis::live;
use analysis::ros_messages::{LiveMessages, robot_names};
use anyhow::bail;
use ros::names::TEAM;
use run_log::LogLevel;
use scenario::{Problem, Setup};
use terminal::stderr_line;
use tokio::runtime::Handle;
use tokio::task::spawn_blocking;
use tokio::time::sleep;

use super::control::RosControl;
use super::topics::{RosTopics, connect};
use super::{OPTION, RosCommand, no_router};
use crate::follow::{self, EndRequests, FollowedRun, follow, while_live};

/// The time for the last messages to leave this process.
const DRAIN_TIME: Duration = Duration::from_millis(200);

/// Checks that a run can be published.
///
/// # Errors
/// Returns an error if the run cannot be followed, or if ROS forbids the name of a robot.
pub fn check(setup: &Setup, log: LogLevel) -> Result<(), Problem> {
    robot_names(setup, OPTION)?;
    live::check(setup, log, OPTION)
}

/// Publishes a run. Returns the exit status.
pub fn run(name: &str, command: &RosCommand) -> ExitCode {
    follow::run(name, publish(command))
}

async fn publish(command: &RosCommand) -> anyhow::Result<()> {
    let mut ends = EndRequests::new()?;
    let followed = FollowedRun {
        folder: command.folder.clone(),
        from_start: command.from_start,
        option: OPTION,
    };
    let Some(mut run) = followed.open(&mut ends).await? else {
        return Ok(());
    };
    stderr_line!("{}", command.describe());
    let router = command.router.clone();
    // Opening a session blocks its thread until there is a router.
    let connecting = spawn_blocking(move || Handle::current().block_on(connect(&router)));
    let connected = while_live(&mut run, connecting);
    let Some(connected) = ends.during(connected).await else {
        return Ok(());
    };
    let Some(session) = connected? else {
        bail!(no_router(&command.router));
    };
    stderr_line!("connected");
    let mut topics = RosTopics::new(session??, command.domain, TEAM)?;
    // The present state is published, but not the past.
    topics.set_silent(!command.from_start);
    let names = robot_names(run.setup(), OPTION)?;
    let control = match &command.control {
        Some(id) => Some(RosControl::new(&topics, id, run.setup(), &names)?),
        None => None,
    };
    let mut messages = LiveMessages::new(run.setup(), &names, topics)?;
    let followed = follow(&mut run, &mut messages, &mut ends, |messages| {
        messages.destination.set_silent(false);
    });
    followed.await?;
    sleep(DRAIN_TIME).await;
    if let Some(control) = control {
        control.report();
    }
    messages.destination.close().await;
    Ok(())
}
