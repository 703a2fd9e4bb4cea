//! One robot as a process of its own, with a mind in Python: all but the mind is the agent's in Rust.

use std::sync::Arc;

use alliance_proto::session::prepare_process;
use clap::Parser;
use launch::Registry;
use launch::arguments::parse_words;
use pyo3::prelude::*;
use pyo3::types::PyType;
use robot_agent::args::{AgentArgs, log_to_stderr};

use crate::errors::mistake;
use crate::mind::{Class, Failure};

#[derive(Parser)]
struct Words {
    #[command(flatten)]
    agent: AgentArgs,
}

/// Joins the run that the words of a command line name, and lives until it ends; returns the exit status. A mind that fails ends
/// the process.
#[pyfunction]
pub fn live(
    py: Python<'_>,
    words: Vec<String>,
    name: &str,
    class: Py<PyType>,
    twice: bool,
) -> PyResult<u8> {
    let class = Class::new(name, class, Failure::EndsProcess, twice);
    let registry = Registry::built_in().mind(Arc::new(class));
    let words: Words = parse_words(&registry.vocabulary(), &words).map_err(mistake)?;
    prepare_process();
    log_to_stderr();
    Ok(py.detach(|| words.agent.run_as(registry.agents(), Some(name))))
}
