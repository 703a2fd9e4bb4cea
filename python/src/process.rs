//! One robot as a separate process with a controller in Python. Everything else is that of the agent in Rust.

use clap::Parser;
use cluster::session::prepare_process;
use launch::Registry;
use launch::arguments::parse_list;
use pyo3::prelude::*;
use pyo3::types::PyType;
use robot_agent::args::AgentArgs;

use crate::controller::FailureReaction;
use crate::controller_class::ControllerClass;
use crate::errors::scenario_error;

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    agent: AgentArgs,
}

/// Joins the run that the command-line arguments select, and returns the exit status at its end. An error of the
/// controller ends the process.
#[pyfunction]
pub fn run_agent(
    py: Python<'_>,
    words: Vec<String>,
    name: &str,
    class: Py<PyType>,
    twice: bool,
) -> PyResult<u8> {
    let class = ControllerClass::new(name, class, FailureReaction::EndsProcess, twice);
    let registry = Registry::built_in().with_controller(class.into_kind()?);
    let args: Arguments = parse_list(&registry.vocabulary(), &words).map_err(scenario_error)?;
    prepare_process();
    args.agent.start_log();
    Ok(py.detach(|| args.agent.run_as(registry.agents(), Some(name))))
}
