//! The exceptions of the Python package.

use std::fmt::Display;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use terminal::in_one_line;

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

/// Returns the text of an error. A path in it can contain line feeds.
fn one_line(error: impl Display) -> String {
    in_one_line(&error.to_string()).into_owned()
}

/// Creates the exception for a mistake in a request.
pub fn scenario_error(error: impl Display) -> PyErr {
    ScenarioError::new_err(one_line(error))
}

/// Creates the exception for any other error, such as a log that cannot be written.
pub fn alliance_error(error: impl Display) -> PyErr {
    AllianceError::new_err(one_line(error))
}
