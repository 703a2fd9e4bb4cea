//! A whole run in this process, with the same bytes as `alliance run --in-process`.

use std::path::PathBuf;

use in_process::{Team, joins_of};
use launch::Registry;
use pyo3::prelude::*;
use run_log::recorder::{Folder, Sink};
use run_log::{LogLevel, MemoryLog, RunFile};

use crate::errors::{alliance_error, scenario_error};
use crate::request::{PreparedRun, RunRequest};

/// The number of ticks between two checks for Ctrl-C.
const TICKS_PER_LOOK: u64 = 256;

/// Executes a run, writes its log to `folder` if that is given, and returns the text of run.json.
#[pyfunction]
pub fn run(
    py: Python<'_>,
    asked: RunRequest,
    folder: Option<PathBuf>,
    level: &str,
) -> PyResult<String> {
    let mut ready = asked.ready(Registry::built_in())?;
    let (setup, randomised) = (&ready.setup, ready.randomised);
    let drawn = randomised.draw_setup(setup, setup.seed, &ready.registry);
    ready.setup = drawn.map_err(scenario_error)?;
    let mut levels = LogLevel::ALL.into_iter();
    let level = levels
        .find(|candidate| candidate.as_str() == level)
        .ok_or_else(|| {
            let known = LogLevel::ALL.map(LogLevel::as_str).join(", ");
            scenario_error(format!("level: there is no '{level}'; there are {known}"))
        })?;
    py.detach(|| {
        let run = match folder {
            None => carry_out(ready, LogLevel::Off, MemoryLog::default())?,
            Some(folder) => {
                let folder = Folder::create(folder).map_err(alliance_error)?;
                carry_out(ready, level, folder)?
            }
        };
        serde_json::to_string(&run).map_err(alliance_error)
    })
}

fn carry_out<S: Sink>(ready: PreparedRun, level: LogLevel, sink: S) -> PyResult<RunFile> {
    let PreparedRun {
        setup,
        registry,
        failure,
        randomised: _,
    } = ready;
    let joins = joins_of(&setup);
    let mut team =
        Team::with_registry(&registry, setup, joins, level, sink).map_err(scenario_error)?;
    loop {
        let outcome = team.tick().map_err(alliance_error)?;
        if let Some(error) = failure.take() {
            return Err(error);
        }
        if let Some(outcome) = outcome {
            let (run, _) = team.end(outcome).map_err(alliance_error)?;
            return Ok(run);
        }
        if team.simulation().tick().is_multiple_of(TICKS_PER_LOOK) {
            Python::attach(|py| py.check_signals())?;
        }
    }
}
