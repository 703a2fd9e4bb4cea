//! The commands that execute a plan, with controllers in Python beside the allocators of the program.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use analysis::controllers::check_is_unknown;
use launch::Registry;
use pyo3::prelude::*;
use pyo3::types::PyType;

use crate::controller::FailureReaction;
use crate::controller_class::ControllerClass;
use crate::errors::scenario_error;

/// Executes a command with these controllers, and returns its exit status. The controllers are part of the registry of
/// this process from then on. `modules`: the files that the files of the controllers have imported.
#[pyfunction]
pub fn execute_plan(
    py: Python<'_>,
    words: Vec<OsString>,
    controllers: Vec<(String, Py<PyType>)>,
    modules: Vec<PathBuf>,
) -> PyResult<u8> {
    let mut registry = Registry::built_in();
    let built_in = registry.vocabulary();
    for (name, class) in controllers {
        check_is_unknown(&name, &built_in).map_err(scenario_error)?;
        let class = ControllerClass::new(&name, class, FailureReaction::EndsRun, false);
        registry = registry.with_allocator_kind(class.into_kind()?);
    }
    Ok(status_of(py.detach(|| {
        launch::execute_plan(registry, &words, modules)
    })))
}

/// Returns the number of an exit status, which has no other way to be read.
fn status_of(status: ExitCode) -> u8 {
    let known = (0..=u8::MAX).find(|number| ExitCode::from(*number) == status);
    known.unwrap_or(1)
}
