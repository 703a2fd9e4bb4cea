//! A controller class as a kind of allocator that scenarios can name.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;
use robot_agent::allocator::{AllocatorKind, ConfigError};
use scenario::{AllocatorSpec, ParameterDefault, ParameterRange, ParameterSpec, Setup};

use crate::agent::{FollowingAllocator, PythonAgents};
use crate::allocator::PythonAllocator;
use crate::controller::*;
use crate::set::loads;

/// A controller class with its name.
pub struct ControllerClass {
    name: &'static str,
    class: Py<PyType>,
    failure: FailureReaction,
    twice: bool,
}

impl ControllerClass {
    /// Creates a class. With `twice`, each step is executed twice from a copy, and the controller fails if the results
    /// differ.
    pub fn new(name: &str, class: Py<PyType>, failure: FailureReaction, twice: bool) -> Self {
        Self {
            name: interned(name),
            class,
            failure,
            twice,
        }
    }
}

/// Returns a copy of the name that lives as long as the program. Each name is stored once.
pub fn interned(name: &str) -> &'static str {
    static NAMES: OnceLock<Mutex<Vec<&'static str>>> = OnceLock::new();
    let names = NAMES.get_or_init(Mutex::default);
    let mut names = names.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.iter().find(|known| **known == name) {
        return known;
    }
    let name: &'static str = name.to_owned().leak();
    names.push(name);
    name
}

impl fmt::Debug for ControllerClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ControllerClass").field(&self.name).finish()
    }
}

impl ControllerClass {
    /// Returns the class for a registry.
    pub fn into_kind(self) -> PyResult<AllocatorKind> {
        let spec = AllocatorSpec {
            name: self.name,
            about: "a controller in Python",
            parameters: self.parameters()?.into(),
            needs_ground_truth: false,
            learns_times: false,
        };
        let is_agent = Python::attach(|py| -> PyResult<bool> {
            let is_agent = self.class.getattr(py, intern!(py, "_is_whole"))?;
            is_agent.extract(py)
        })?;
        Ok(if is_agent {
            AllocatorKind::with_controller::<FollowingAllocator, _>(
                spec,
                move |setup| Ok(PythonAgents::new(self.data(setup)?)),
                PythonAgents::controller,
            )
        } else {
            AllocatorKind::with_config::<PythonAllocator>(spec, move |setup| self.data(setup))
        })
    }

    /// Returns the parameters that the class declares: by name the default, the least and the greatest value.
    fn parameters(&self) -> PyResult<Vec<ParameterSpec>> {
        let declared: BTreeMap<String, (f64, f64, f64)> = Python::attach(|py| {
            let checked = py
                .import(intern!(py, "alliance_sim._controllers"))?
                .call_method1(intern!(py, "parameters_of"), (&self.class,))?;
            checked.extract()
        })?;
        let spec = |(name, (default, least, greatest)): (String, (f64, f64, f64))| ParameterSpec {
            key: interned(&name),
            unit: "",
            default: ParameterDefault::Number(default),
            about: "a parameter of a controller in Python",
            range: ParameterRange::Within(least, greatest),
        };
        Ok(declared.into_iter().map(spec).collect())
    }

    fn data(&self, setup: &Setup) -> Result<Arc<ClassData>, ConfigError> {
        let failure = |reason: String| ConfigError {
            subject: format!("controller '{}'", self.name),
            why: reason,
        };
        let text = serde_json::to_string(setup).map_err(|error| failure(error.to_string()))?;
        let data = Python::attach(|py| {
            let setup_object = py
                .import(intern!(py, "alliance_sim._setup"))?
                .call_method1(intern!(py, "read_only"), (loads(py, &text)?,))?;
            let shared = match self.failure {
                // A robot with its own process shares nothing.
                FailureReaction::EndsProcess => None,
                FailureReaction::Stored(_) | FailureReaction::EndsRun => py
                    .import(intern!(py, "alliance_sim._isolation"))?
                    .call_method1(intern!(py, "SharedVariables"), (&self.class,))?
                    .extract()?,
            };
            Ok(Arc::new(ClassData {
                name: self.name,
                class: self.class.clone_ref(py),
                failure: self.failure.clone(),
                twice: self.twice,
                setup: setup.clone(),
                setup_object: setup_object.unbind(),
                shared,
                is_slow: AtomicBool::new(false),
            }))
        });
        data.map_err(|error: PyErr| failure(error.to_string()))
    }
}
