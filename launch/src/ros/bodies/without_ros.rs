//! Replacement for `bridge` in a program that is built without ROS. Its callers have refused the option already.

use std::process::ExitCode;

use scenario::{Problem, Setup};

/// Returns no names, because there are no topics.
pub fn robot_names(_: &Setup) -> Result<Vec<String>, Problem> {
    Ok(Vec::new())
}

/// Connects nothing, because the program lacks the feature.
pub fn run(_: &str) -> ExitCode {
    ExitCode::from(2)
}
