//! Errors as Python has them.

use std::fmt::Display;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    alliance_agent,
    AllianceError,
    PyException,
    "What went wrong, in the one line that the program has for it."
);
create_exception!(
    alliance_agent,
    ScenarioError,
    AllianceError,
    "A mistake in what was asked for: what, where, and what would be right."
);
create_exception!(
    alliance_agent,
    MindError,
    AllianceError,
    "A mind written in Python failed: which robot's, in which tick, and where. Its cause is what was raised there."
);

/// A mistake in what was asked for.
pub fn mistake(error: impl Display) -> PyErr {
    ScenarioError::new_err(error.to_string())
}

/// Anything else, such as a log that cannot be written.
pub fn failed(error: impl Display) -> PyErr {
    AllianceError::new_err(error.to_string())
}
