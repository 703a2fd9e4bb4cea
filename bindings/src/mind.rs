//! An allocator that is written in Python: a class derived from `alliance_agent.Allocator`.
//!
//! To the engine it is a rule like any other: heartbeats, changes of state and the step that goes back are made for it.

use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use alliance_proto::allocation::{AllocationMessage, OpenMessage};
use alliance_proto::ids::{BehaviorId, RobotId};
use alliance_proto::scenario::{AllocatorSpec, Setup};
use alliance_proto::time::SimTime;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyType};
use robot_agent::allocator::{
    Allocator, ConfigError, Decision, Framed, Input, Kind, Me, Mind, Prepared,
};

use crate::errors::MindError;
use crate::rows::rows;
use crate::values::{Heard, OwnSet, Set, Stream, loads};

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
}

impl Class {
    pub fn new(name: &str, class: Py<PyType>, failure: Failure) -> Self {
        Self {
            name: kept(name),
            class,
            failure,
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
        Python::attach(|py| {
            let told = loads(py, &text).map_err(|error| refused(error.to_string()))?;
            Ok(Arc::new(OfRun(Arc::new(Common {
                name: self.name,
                class: self.class.clone_ref(py),
                failure: self.failure.clone(),
                setup: setup.clone(),
                told: told.unbind(),
            }))) as Arc<dyn Prepared>)
        })
    }
}

/// What all minds of a class have in common in a run.
struct Common {
    name: &'static str,
    class: Py<PyType>,
    failure: Failure,
    setup: Setup,
    /// The same as Python has it.
    told: Py<PyAny>,
}

impl fmt::Debug for Common {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Common").field(&self.name).finish()
    }
}

#[derive(Debug)]
struct OfRun(Arc<Common>);

impl Prepared for OfRun {
    fn mind(&self, me: Me, _: &Setup) -> Box<dyn Mind> {
        Box::new(Framed::<Rule>::new(me, &self.0))
    }
}

/// One robot's mind.
#[derive(Debug)]
struct Rule {
    common: Arc<Common>,
    me: RobotId,
    /// `None` if it could not be made.
    mind: Option<Py<PyAny>>,
    stream: Py<Stream>,
    own: Arc<[Arc<OwnSet>]>,
    /// Since when each set is active, or not; empty before the first step.
    since: Vec<SimTime>,
}

impl fmt::Debug for Stream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Stream")
    }
}

impl Clone for Rule {
    /// A checkpoint: `copy.deepcopy`, but for what the class calls frozen.
    fn clone(&self) -> Self {
        Python::attach(|py| Self {
            common: Arc::clone(&self.common),
            me: self.me,
            mind: self.mind.as_ref().and_then(|mind| {
                let copied = py
                    .import("copy")
                    .and_then(|copy| copy.call_method1("deepcopy", (mind,)));
                self.or_note(py, 0, copied.map(Bound::unbind))
            }),
            stream: self.stream.clone_ref(py),
            own: Arc::clone(&self.own),
            since: self.since.clone(),
        })
    }
}

impl Allocator for Rule {
    type Config = Arc<Common>;

    fn new(me: &Me, common: &Arc<Common>) -> Self {
        Python::attach(|py| {
            let stream = Py::new(py, Stream::new());
            let stream = stream.unwrap_or_else(|error| panic!("{error}"));
            let mut rule = Self {
                common: Arc::clone(common),
                me: me.robot,
                mind: None,
                stream,
                own: [].into(),
                since: Vec::new(),
            };
            let made = rule.make(py, me);
            rule.mind = rule.or_note(py, 0, made);
            rule
        })
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        if self.common.failure.is_there() {
            decision.active = None;
            return;
        }
        if self.since.is_empty() {
            self.since = vec![input.now; self.own.len()];
        }
        let before = decision.active;
        Python::attach(|py| {
            let stepped = self.try_step(py, input, decision);
            let tick = input.now.0 / self.common.setup.scenario.step_ms;
            if self.or_note(py, tick, stepped).is_none() {
                decision.active = None;
                decision.say.clear();
                decision.rows.clear();
            }
        });
        if decision.active != before {
            for (own, since) in self.own.iter().zip(&mut self.since) {
                if Some(own.id) == before || Some(own.id) == decision.active {
                    *since = input.now;
                }
            }
        }
    }
}

impl Rule {
    fn name(&self) -> &str {
        self.common.setup.roster.name(self.me)
    }

    /// An error is told in one line that says whose mind failed, when and where.
    fn or_note<T>(&self, py: Python<'_>, tick: u64, done: PyResult<T>) -> Option<T> {
        let error = match done {
            Ok(done) => return Some(done),
            Err(error) => error,
        };
        // An error that Rust has caught knows where it came from, and its value does not.
        let value = error.value(py);
        let told = value
            .setattr("__traceback__", error.traceback(py))
            .and_then(|()| py.import("alliance_agent._minds"))
            .and_then(|it| it.call_method1("line_of", (self.name(), tick, value)))
            .and_then(|line| line.extract::<String>());
        let failed = MindError::new_err(told.unwrap_or_else(|_| error.to_string()));
        failed.set_cause(py, Some(error));
        self.common.failure.note(py, failed);
        None
    }

    fn make(&mut self, py: Python<'_>, me: &Me) -> PyResult<Py<PyAny>> {
        let Common {
            setup, told, class, ..
        } = &*self.common;
        let told = told.bind(py);
        let (catalog, name) = (&setup.catalog, setup.roster.name(me.robot));
        let values = told.get_item("alliance")?.get_item("robots")?;
        let own = me.behaviors.iter().map(|behavior| {
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
        let mind = class.bind(py).call0()?;
        let begin = intern!(py, "_begin");
        mind.call_method1(begin, (name, me.robot.0, told, &self.stream))?;
        Ok(mind.unbind())
    }

    fn try_step(&self, py: Python<'_>, input: &Input<'_>, decision: &mut Decision) -> PyResult<()> {
        let Some(mind) = &self.mind else {
            return Ok(());
        };
        let mind = mind.bind(py);
        self.stream.get().begin(input.draws);
        let name = self.common.name;
        let heard = input.heard.iter().filter_map(|it| Heard::of(it, name));
        let heard = heard.map(|it| Bound::new(py, it));
        let heard = PyList::new(py, heard.collect::<PyResult<Vec<_>>>()?)?;
        let sets = self.own.iter().zip(&self.since).zip(input.choices);
        let sets = sets.map(|((own, since), choice)| {
            let active = decision.active == Some(own.id);
            Bound::new(py, Set::new(Arc::clone(own), *choice, active, *since))
        });
        let sets = PyList::new(py, sets.collect::<PyResult<Vec<_>>>()?)?;
        let now = input.now.as_secs_f64();
        let chosen = mind.call_method1(intern!(py, "step"), (now, heard, sets))?;
        decision.active = self.chosen(&chosen, input)?;
        self.take_words(mind, decision)?;
        self.take_bids(mind, input, decision)
    }

    fn chosen(&self, chosen: &Bound<'_, PyAny>, input: &Input<'_>) -> PyResult<Option<BehaviorId>> {
        if chosen.is_none() {
            return Ok(None);
        }
        let Ok(set) = chosen.cast::<Set>() else {
            let what = chosen.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "step returned {what}; it must return one of its sets or None"
            )));
        };
        let behavior = set.get().behavior();
        let mut choices = input.choices.iter();
        match choices.find(|choice| choice.behavior == behavior) {
            Some(choice) if choice.applicable => Ok(Some(behavior)),
            Some(_) => Err(PyValueError::new_err(format!(
                "step returned {}, which is not applicable; it must return one that is, or None",
                set.repr()?
            ))),
            None => Err(PyValueError::new_err(format!(
                "step returned {}, which is none of its own",
                set.repr()?
            ))),
        }
    }

    /// What it says to teammates.
    fn take_words(&self, mind: &Bound<'_, PyAny>, decision: &mut Decision) -> PyResult<()> {
        let said = mind.getattr(intern!(mind.py(), "_said"))?;
        let said = said.cast::<PyList>()?;
        if said.is_empty() {
            return Ok(());
        }
        for words in said.iter() {
            let bytes = words.cast::<PyBytes>()?.as_bytes().to_vec();
            let schema = self.common.name.to_owned();
            let message = OpenMessage { schema, bytes };
            decision.say.push(AllocationMessage::Open(message));
        }
        said.del_slice(0, said.len())
    }

    /// What the log shows of its reasoning.
    fn take_bids(
        &self,
        mind: &Bound<'_, PyAny>,
        input: &Input<'_>,
        decision: &mut Decision,
    ) -> PyResult<()> {
        let bids = mind.getattr(intern!(mind.py(), "_bids"))?;
        let bids = bids.cast::<PyDict>()?;
        let mut known: Vec<(BehaviorId, f64)> = Vec::new();
        for (set, bid) in bids.iter() {
            known.push((BehaviorId(set.extract()?), bid.extract()?));
        }
        bids.clear();
        rows(self.me, input, decision, |set| {
            let mut known = known.iter();
            known.find(|(it, _)| *it == set).map(|(_, bid)| *bid)
        });
        Ok(())
    }
}
