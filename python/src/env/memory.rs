//! The check that a batch of environments fits into memory, because a failed allocation would end the interpreter.

use std::fs;

use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

use super::common::Common;
use super::part::{actions, width};

/// The bytes of an episode without its robots. These numbers were fitted to measured batches of teams of 3 to 30 robots.
const EPISODE: usize = 20_000;

/// The bytes of a robot in an episode, besides its links and tasks.
const ROBOT: usize = 20_000;

/// The bytes of a robot for each teammate.
const LINK: usize = 1_000;

/// The bytes of a robot for each task.
const ROBOT_TASK: usize = 1_700;

/// Raises a `MemoryError` if the environments do not fit.
pub fn check_memory(common: &Common, envs: usize) -> PyResult<()> {
    let each = bytes_of(common);
    let needed = each.checked_mul(envs).filter(|needed| fits(*needed));
    if needed.is_some() {
        return Ok(());
    }
    let gigabytes = each as f64 * envs as f64 / 1e9;
    Err(PyMemoryError::new_err(format!(
        "envs: {envs} environments of about {} kB each need {gigabytes:.1} GB, more than is available; use fewer",
        each.div_ceil(1000)
    )))
}

/// Returns the approximate bytes of an environment, with its rows in the arrays of the engine and of Python.
fn bytes_of(common: &Common) -> usize {
    let robots = common.setup.scenario.robots.len();
    let row = common.features * size_of::<f32>() + actions(common) + 1;
    let tasks = common.setup.catalog.tasks.len();
    let robot = ROBOT + robots * LINK + tasks * ROBOT_TASK;
    EPISODE + robots * robot + 2 * width(common) * row
}

/// Returns whether a block of that size can be allocated and is available.
fn fits(bytes: usize) -> bool {
    let reserved = Vec::<u8>::new().try_reserve_exact(bytes);
    reserved.is_ok() && available().is_none_or(|available| bytes < available)
}

/// Returns the available memory, bytes, or `None` if the operating system does not report it.
fn available() -> Option<usize> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: usize = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}
