//! Replacement for `rosbag` in a program that is built without it.

use std::path::Path;

use run_log::RunLog;

/// Returns an error, because this program has no support of ROS bags.
pub fn check(_: &RunLog, _: &Path) -> anyhow::Result<()> {
    super::rosbag_is_there()
}

/// Returns an error, because this program has no support of ROS bags.
pub fn write(_: &RunLog, _: &Path) -> anyhow::Result<()> {
    super::rosbag_is_there()
}
