//! Replacement for `publish` in a program that is built without ROS. Its callers have refused the option already.

use std::process::ExitCode;

use robot_agent::args::AgentArgs;
use run_log::LogLevel;
use scenario::{Problem, Setup};

use super::{RosAgentArgs, RosCommand};

/// Accepts every run, because nothing is published.
pub fn check(_: &Setup, _: LogLevel) -> Result<(), Problem> {
    Ok(())
}

/// Publishes nothing, because the program lacks the feature.
pub fn run(_: &str, _: &RosCommand) -> ExitCode {
    ExitCode::from(2)
}

/// Controls no robot, because the program lacks the feature.
pub fn run_robot(_: &str, _: &RosAgentArgs, _: &AgentArgs) -> ExitCode {
    ExitCode::from(2)
}
