//! The exceptions of the Python package.

use std::fmt::Display;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    alliance_sim,
    AllianceError,
    PyException,
    "An error of the simulator. The message is the line that the program prints."
);
create_exception!(
    alliance_sim,
    ScenarioError,
    AllianceError,
    "A mistake in the request. The message states the position, the problem and the remedy."
);
create_exception!(
    alliance_sim,
    ControllerError,
    AllianceError,
    "A controller written in Python failed. The message states the robot, the tick and the position. The cause is the original exception."
);

/// Creates the exception for a mistake in a request.
pub fn scenario_error(error: impl Display) -> PyErr {
    ScenarioError::new_err(error.to_string())
}

/// Creates the exception for any other error, such as a log that cannot be written.
pub fn alliance_error(error: impl Display) -> PyErr {
    AllianceError::new_err(error.to_string())
}
