//! The engine of the Python package `alliance-agent`, imported as `alliance_agent._engine`.
//!
//! - [`asked`]: what is to be run, in the words of the command line.
//! - [`mind`]: a mind that is written in Python: an [`allocator`], or all of it, an [`agent`].
//! - [`values`], [`readings`]: what such a one is given in a step.
//! - [`math`]: functions of numbers for such minds.
//! - [`run`]: a whole run in this process. [`env`]: runs that are stepped from outside. [`process`]: one robot as a process.
//!
//! Python's side checks its callers' types and has the documentation for people; errors of a mission have the one line that the
//! program has for them.

use pyo3::prelude::*;

mod agent;
mod allocator;
mod asked;
mod env;
mod errors;
mod math;
mod mind;
mod process;
mod readings;
mod rows;
mod run;
mod values;

/// `alliance_agent._engine`.
#[pymodule]
mod _engine {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::env::Worlds;
    #[pymodule_export]
    use crate::errors::{AllianceError, MindError, ScenarioError};
    #[pymodule_export]
    use crate::process::live;
    #[pymodule_export]
    use crate::run::run;
    #[pymodule_export]
    use crate::values::{Heard, Set, Stream};

    #[pymodule_init]
    fn with_math(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let math = PyModule::new(module.py(), "math")?;
        crate::math::add(&math)?;
        module.add_submodule(&math)
    }
}
