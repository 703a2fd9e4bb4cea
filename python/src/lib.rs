//! The engine of the Python package `alliance-sim`, imported as `alliance_sim._engine`.
//!
//! - [`request`]: the description of a run, with the arguments of the command line.
//! - [`controller`]: controllers written in Python, which replace an [`allocator`] or the whole controller ([`agent`]).
//! - [`set`], [`message`], [`readings`]: the arguments of a controller's step. [`stream`]: its random numbers.
//! - [`math`]: numerical functions for such controllers.
//! - [`plan`]: sweeps, comparisons and searches. [`run`]: a whole run in this process. [`env`]: runs that are stepped from
//!   outside. [`process`]: one robot as a process.
//! - [`table`]: the tables of a logged run.
//!
//! The Python package checks the types of its callers and contains the documentation for users. Errors of a mission
//! have the one line that the program prints.

use pyo3::prelude::*;

mod agent;
mod allocator;
mod controller;
mod controller_class;
mod env;
mod errors;
mod math;
mod message;
mod plan;
mod process;
mod readings;
mod request;
mod rows;
mod run;
mod set;
mod stream;
mod table;

/// The Python module `alliance_sim._engine`.
#[pymodule]
mod _engine {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::env::{EnvironmentBatch, EnvironmentStates};
    #[pymodule_export]
    use crate::errors::{AllianceError, ControllerError, ScenarioError};
    #[pymodule_export]
    use crate::message::{Message, restored_message};
    #[pymodule_export]
    use crate::plan::execute_plan;
    #[pymodule_export]
    use crate::process::run_agent;
    #[pymodule_export]
    use crate::run::run;
    #[pymodule_export]
    use crate::set::Set;
    #[pymodule_export]
    use crate::stream::Stream;
    #[pymodule_export]
    use crate::table::full_table;

    #[pymodule_init]
    fn prepare(module: &Bound<'_, PyModule>) -> PyResult<()> {
        proto::program_build::set(launch::BUILD);
        let math = PyModule::new(module.py(), "math")?;
        crate::math::add(&math)?;
        module.add_submodule(&math)?;
        module.add("VERSION", env!("CARGO_PKG_VERSION"))?;
        module.add("BUILD", launch::BUILD)?;
        module.add("BOUND", crate::env::BOUND)
    }
}
