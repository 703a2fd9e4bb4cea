//! A mind that is written in Python: a class derived from `alliance_agent.Allocator` or `alliance_agent.Agent`, and one robot's object
//! of it. What it decides is `allocator`'s and `agent`'s.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use alliance_proto::allocation::{AllocationMessage, OpenMessage};
use alliance_proto::ids::RobotId;
use alliance_proto::scenario::{AllocatorSpec, Setup};
use alliance_proto::team::Broadcast;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList, PyType};
use robot_agent::allocator::{ConfigError, Draws, Kind, OwnBehavior, Prepared};

use crate::agent::Agents;
use crate::allocator::Allocators;
use crate::errors::MindError;
use crate::values::{Heard, OwnSet, Stream, loads};

/// What is done about a mind that fails.
#[derive(Clone)]
pub enum Failure {
    /// It is kept for whoever drives the run; all minds stand still from then on.
    Kept(Arc<Mutex<Option<PyErr>>>),
    /// It is told, and the process ends: to the team that is a robot's death.
    EndsProcess,
}

impl Failure {
    /// The error that was kept, if any.
    pub fn take(&self) -> Option<PyErr> {
        match self {
            Self::Kept(place) => place.lock().unwrap_or_else(PoisonError::into_inner).take(),
            Self::EndsProcess => None,
        }
    }

    fn is_there(&self) -> bool {
        match self {
            Self::Kept(place) => {
                let place = place.lock().unwrap_or_else(PoisonError::into_inner);
                place.is_some()
            }
            Self::EndsProcess => false,
        }
    }

    fn note(&self, py: Python<'_>, error: PyErr) {
        match self {
            Self::Kept(place) => {
                let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
                place.get_or_insert(error);
            }
            Self::EndsProcess => {
                alliance_proto::tell!("robot-agent {}", error.value(py));
                std::process::exit(alliance_proto::panics::PANICKED);
            }
        }
    }
}

/// A class of minds under its name.
pub struct Class {
    name: &'static str,
    class: Py<PyType>,
    failure: Failure,
    twice: bool,
}

impl Class {
    /// `twice`: each step is made twice, from a copy, and the mind fails where the two differ.
    pub fn new(name: &str, class: Py<PyType>, failure: Failure, twice: bool) -> Self {
        Self {
            name: kept(name),
            class,
            failure,
            twice,
        }
    }
}

/// Names of allocators live as long as the program; each is kept once.
fn kept(name: &str) -> &'static str {
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

impl fmt::Debug for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Class").field(&self.name).finish()
    }
}

impl Kind for Class {
    fn spec(&self) -> AllocatorSpec {
        AllocatorSpec {
            name: self.name,
            about: "a mind in Python",
            parameters: Vec::new(),
            wants_truth: false,
            learns: false,
        }
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError> {
        let refused = |why: String| ConfigError {
            subject: format!("mind '{}'", self.name),
            why,
        };
        let text = serde_json::to_string(setup).map_err(|error| refused(error.to_string()))?;
        let prepared = Python::attach(|py| {
            let is_whole = self.class.getattr(py, intern!(py, "_is_whole"))?;
            let common = Arc::new(Common {
                name: self.name,
                class: self.class.clone_ref(py),
                failure: self.failure.clone(),
                twice: self.twice,
                setup: setup.clone(),
                told: loads(py, &text)?.unbind(),
                is_slow: AtomicBool::new(false),
            });
            let prepared: Arc<dyn Prepared> = if is_whole.extract(py)? {
                Arc::new(Agents::new(common))
            } else {
                Arc::new(Allocators(common))
            };
            Ok(prepared)
        });
        prepared.map_err(|error: PyErr| refused(error.to_string()))
    }
}

/// What all minds of a class have in common in a run.
pub struct Common {
    pub name: &'static str,
    class: Py<PyType>,
    pub failure: Failure,
    twice: bool,
    pub setup: Setup,
    /// The same as Python has it.
    told: Py<PyAny>,
    /// Whether it has been told that copies take long.
    is_slow: AtomicBool,
}

impl Common {
    /// In a live run the team waits for a checkpoint: once it is told if one takes longer than a step of the run.
    fn tell_if_slow(&self, me: RobotId, took: Duration) {
        let step = Duration::from_millis(self.setup.scenario.step_ms);
        let is_live = matches!(self.failure, Failure::EndsProcess);
        if is_live && took > step && !self.is_slow.swap(true, Ordering::Relaxed) {
            alliance_proto::tell!(
                "robot-agent {}: a copy of its mind takes {} ms, longer than a step of {} ms: name in `frozen` what does not change",
                self.setup.roster.name(me),
                took.as_millis(),
                step.as_millis()
            );
        }
    }
}

impl fmt::Debug for Common {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Common").field(&self.name).finish()
    }
}

impl fmt::Debug for Stream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Stream")
    }
}

/// One robot's object of a class.
#[derive(Debug)]
pub struct Object {
    pub common: Arc<Common>,
    pub me: RobotId,
    pub own: Arc<[Arc<OwnSet>]>,
    /// `None` if it could not be made.
    mind: Option<Py<PyAny>>,
    stream: Py<Stream>,
}

impl Clone for Object {
    /// A checkpoint: `copy.deepcopy`, but for what the class calls frozen.
    fn clone(&self) -> Self {
        #[expect(
            clippy::disallowed_methods,
            reason = "nothing but a warning depends on it"
        )]
        let began = Instant::now();
        let copy = Python::attach(|py| Self {
            common: Arc::clone(&self.common),
            me: self.me,
            own: Arc::clone(&self.own),
            mind: self.mind.as_ref().and_then(|mind| {
                let copied = py
                    .import("copy")
                    .and_then(|copy| copy.call_method1("deepcopy", (mind,)));
                self.or_note(py, 0, copied.map(Bound::unbind))
            }),
            stream: self.stream.clone_ref(py),
        });
        self.common.tell_if_slow(self.me, began.elapsed());
        copy
    }
}

impl Object {
    /// That of a robot at the start of a life.
    pub fn new(me: RobotId, behaviors: &[OwnBehavior], common: &Arc<Common>) -> Self {
        Python::attach(|py| {
            let stream = Py::new(py, Stream::new());
            let stream = stream.unwrap_or_else(|error| panic!("{error}"));
            let mut object = Self {
                common: Arc::clone(common),
                me,
                own: [].into(),
                mind: None,
                stream,
            };
            let made = object.make(py, behaviors);
            object.mind = object.or_note(py, 0, made);
            object
        })
    }

    fn make(&mut self, py: Python<'_>, behaviors: &[OwnBehavior]) -> PyResult<Py<PyAny>> {
        let Common {
            setup, told, class, ..
        } = &*self.common;
        let told = told.bind(py);
        let (catalog, name) = (&setup.catalog, setup.roster.name(self.me));
        let values = told.get_item("alliance")?.get_item("robots")?;
        let own = behaviors.iter().map(|behavior| {
            let set = catalog.behavior_name(behavior.id).to_owned();
            let values = values.get_item(name)?.get_item("sets")?.get_item(&set)?;
            Ok(Arc::new(OwnSet {
                id: behavior.id,
                name: set,
                task: behavior.task,
                task_name: catalog.task_name(behavior.task).to_owned(),
                ceased_after_s: values.get_item("ceased_after_s")?.extract()?,
                values: values.unbind(),
            }))
        });
        self.own = own.collect::<PyResult<Vec<_>>>()?.into();
        let sets = self.own.iter().map(|own| own.name.as_str());
        let sets = PyList::new(py, sets.collect::<Vec<_>>())?;
        let mind = class.bind(py).call0()?;
        let begin = intern!(py, "_begin");
        mind.call_method1(begin, (name, self.me.0, told, &self.stream, sets))?;
        Ok(mind.unbind())
    }

    /// Whether some mind of the run has failed: then all stand still.
    pub fn has_failed(&self) -> bool {
        self.common.failure.is_there()
    }

    /// An error is told in one line that says whose mind failed, when and where.
    pub fn or_note<T>(&self, py: Python<'_>, tick: u64, done: PyResult<T>) -> Option<T> {
        let error = match done {
            Ok(done) => return Some(done),
            Err(error) => error,
        };
        let name = self.common.setup.roster.name(self.me);
        // An error that Rust has caught knows where it came from, and its value does not.
        let value = error.value(py);
        let told = value
            .setattr("__traceback__", error.traceback(py))
            .and_then(|()| py.import("alliance_agent._minds"))
            .and_then(|it| it.call_method1("line_of", (name, tick, value)))
            .and_then(|line| line.extract::<String>());
        let failed = MindError::new_err(told.unwrap_or_else(|_| error.to_string()));
        failed.set_cause(py, Some(error));
        self.common.failure.note(py, failed);
        None
    }

    /// Calls its `step`, with what is given and what it hears of teammates; `None`: there is no such mind.
    pub fn step<'py>(
        &self,
        py: Python<'py>,
        draws: Draws,
        given: impl FnOnce(Bound<'py, PyList>) -> PyResult<Bound<'py, pyo3::types::PyTuple>>,
        heard: &[Arc<Broadcast>],
    ) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        let Some(mind) = &self.mind else {
            return Ok(None);
        };
        let mind = mind.bind(py).clone();
        self.stream.get().begin(draws);
        let heard = heard
            .iter()
            .filter_map(|it| Heard::of(it, self.common.name))
            .map(|it| Bound::new(py, it));
        let heard = PyList::new(py, heard.collect::<PyResult<Vec<_>>>()?)?;
        let given = given(heard)?;
        let done = if self.common.twice {
            let minds = py.import(intern!(py, "alliance_agent._minds"))?;
            minds.call_method1(intern!(py, "step_twice"), (&mind, given))?
        } else {
            mind.call_method1(intern!(py, "step"), given)?
        };
        Ok(Some((mind, done)))
    }

    /// What it says to teammates, from its list of words.
    pub fn take_words(&self, mind: &Bound<'_, PyAny>) -> PyResult<Vec<AllocationMessage>> {
        let said = mind.getattr(intern!(mind.py(), "_said"))?;
        let said = said.cast::<PyList>()?;
        let words = said.iter().map(|words| {
            let bytes = words.cast::<PyBytes>()?.as_bytes().to_vec();
            let schema = self.common.name.to_owned();
            Ok(AllocationMessage::Open(OpenMessage { schema, bytes }))
        });
        let words = words.collect::<PyResult<Vec<_>>>()?;
        if !said.is_empty() {
            said.del_slice(0, said.len())?;
        }
        Ok(words)
    }
}
