//! Controllers written in Python: a class derived from `alliance_sim.Allocator` or `alliance_sim.Agent`, and its
//! object for one robot. The modules `allocator` and `agent` apply its decisions.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use proto::allocation::{AllocationMessage, OpenMessage};
use proto::team::Broadcast;
use pyo3::exceptions::PyException;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList, PyString, PyTuple, PyType};
use robot_agent::allocator::{OwnBehavior, RandomDraws};
use scenario::Setup;
use scenario::ids::{RobotId, TaskId};

use crate::errors::ControllerError;
use crate::message::Message;
use crate::set::SetDefinition;
use crate::stream::Stream;

/// The reaction to an error of a controller.
#[derive(Clone)]
pub enum FailureReaction {
    /// The error is stored for the caller of the run. All controllers stop from then on.
    Stored(Arc<StoredError>),
    /// The error is printed and the process ends, which the team observes as a crash of the robot.
    EndsProcess,
    /// The error ends the run of a plan, which records it as the reason of the failure.
    EndsRun,
}

/// The first error of the controllers of a run.
#[derive(Default)]
pub struct StoredError {
    /// True if there is an error. All threads of a batch look at it after each tick, and a lock would delay them.
    is_there: AtomicBool,
    error: Mutex<Option<PyErr>>,
}

impl StoredError {
    fn lock(&self) -> MutexGuard<'_, Option<PyErr>> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self) -> Option<PyErr> {
        if !self.is_there.load(Ordering::Relaxed) {
            return None;
        }
        self.is_there.store(false, Ordering::Relaxed);
        self.lock().take()
    }

    fn store(&self, error: PyErr) {
        self.lock().get_or_insert(error);
        self.is_there.store(true, Ordering::Relaxed);
    }
}

impl FailureReaction {
    /// Removes and returns the stored error, if there is one.
    pub fn take(&self) -> Option<PyErr> {
        match self {
            Self::Stored(stored) => stored.take(),
            Self::EndsProcess | Self::EndsRun => None,
        }
    }

    fn is_stored(&self) -> bool {
        match self {
            Self::Stored(stored) => stored.is_there.load(Ordering::Relaxed),
            Self::EndsProcess | Self::EndsRun => false,
        }
    }

    fn note(&self, py: Python<'_>, error: PyErr) {
        match self {
            Self::Stored(stored) => stored.store(error),
            Self::EndsProcess => {
                terminal::stderr_line!("robot-agent {}", error.value(py));
                std::process::exit(terminal::panics::PANICKED);
            }
            Self::EndsRun => terminal::panics::end_run(error.value(py).to_string()),
        }
    }
}

/// The data that all controllers of a class share in a run.
pub struct ClassData {
    pub name: &'static str,
    pub class: Py<PyType>,
    pub failure: FailureReaction,
    pub twice: bool,
    pub setup: Setup,
    /// The setup as a read-only Python object.
    pub setup_object: Py<PyAny>,
    /// The variables outside the objects that several robots of this process would share; `None` if the process has only
    /// one robot.
    pub shared: Option<Py<PyAny>>,
    /// `true` after the warning about slow copies.
    pub is_slow: AtomicBool,
}

impl ClassData {
    /// Prints a warning, once, if a checkpoint takes longer than a step of a live run: the team waits for it.
    fn warn_if_slow(&self, me: RobotId, took: Duration) {
        let step = Duration::from_millis(self.setup.scenario.step_ms);
        let is_live = matches!(self.failure, FailureReaction::EndsProcess);
        if is_live && took > step && !self.is_slow.swap(true, Ordering::Relaxed) {
            terminal::stderr_line!(
                "robot-agent {}: a copy of its controller takes {} ms, longer than a step of {} ms: list constant attributes in `frozen`",
                self.setup.roster.name(me),
                took.as_millis(),
                step.as_millis()
            );
        }
    }
}

impl fmt::Debug for ClassData {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ClassData").field(&self.name).finish()
    }
}

impl fmt::Debug for Stream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Stream")
    }
}

/// The object of a controller class for one robot.
#[derive(Debug)]
pub struct ControllerObject {
    pub common: Arc<ClassData>,
    pub me: RobotId,
    pub sets: Arc<[Arc<SetDefinition>]>,
    /// The Python object; `None` if its creation failed.
    controller: Option<Py<PyAny>>,
    stream: Py<Stream>,
}

impl Clone for ControllerObject {
    /// Creates a checkpoint with `copy.deepcopy`, which shares the attributes that the class lists as frozen.
    fn clone(&self) -> Self {
        #[expect(
            clippy::disallowed_methods,
            reason = "only a warning depends on the time"
        )]
        let began = Instant::now();
        let copy = Python::attach(|py| Self {
            common: Arc::clone(&self.common),
            me: self.me,
            sets: Arc::clone(&self.sets),
            controller: self.controller.as_ref().and_then(|controller| {
                let copied = py
                    .import("copy")
                    .and_then(|copy| copy.call_method1("deepcopy", (controller,)));
                self.store_error(py, 0, copied.map(Bound::unbind))
            }),
            stream: self.stream.clone_ref(py),
        });
        self.common.warn_if_slow(self.me, began.elapsed());
        copy
    }
}

impl ControllerObject {
    /// Creates the object of a robot at the start of an incarnation.
    pub fn new(me: RobotId, behaviors: &[OwnBehavior], common: &Arc<ClassData>) -> Self {
        Python::attach(|py| {
            let stream = Py::new(py, Stream::new());
            let stream = stream.unwrap_or_else(|error| panic!("{error}"));
            let mut object = Self {
                common: Arc::clone(common),
                me,
                sets: [].into(),
                controller: None,
                stream,
            };
            let created = object.make(py, behaviors);
            object.controller = object.store_error(py, 0, created);
            object
        })
    }

    fn make(&mut self, py: Python<'_>, behaviors: &[OwnBehavior]) -> PyResult<Py<PyAny>> {
        let ClassData {
            setup,
            setup_object,
            class,
            ..
        } = &*self.common;
        let setup_object = setup_object.bind(py);
        let (catalog, name) = (&setup.catalog, setup.roster.name(self.me));
        let values = setup_object.get_item("alliance")?.get_item("robots")?;
        let own = behaviors.iter().map(|behavior| {
            let set_name = catalog.behavior_name(behavior.id).to_owned();
            let values = values
                .get_item(name)?
                .get_item("sets")?
                .get_item(&set_name)?;
            Ok(Arc::new(SetDefinition {
                id: behavior.id,
                name: set_name,
                task: behavior.task,
                task_name: catalog.task_name(behavior.task).to_owned(),
                ceased_after_s: values.get_item("ceased_after_s")?.extract()?,
                values: values.unbind(),
            }))
        });
        self.sets = own.collect::<PyResult<Vec<_>>>()?.into();
        let sets = self.sets.iter().map(|set| set.name.as_str());
        let sets = PyList::new(py, sets.collect::<Vec<_>>())?;
        let controller = class.bind(py).call0()?;
        let begin = intern!(py, "_begin");
        let own_name = self.common.name;
        let team = setup.scenario.robots.iter().map(|robot| &*robot.name);
        let team = PyTuple::new(py, team.collect::<Vec<_>>())?;
        let tasks = (0..catalog.tasks.len() as u32).map(|task| catalog.task_name(TaskId(task)));
        let tasks = PyTuple::new(py, tasks.collect::<Vec<_>>())?;
        let given = (
            name,
            self.me.0,
            setup_object,
            &self.stream,
            sets,
            own_name,
            team,
            tasks,
        );
        let begun = controller.call_method1(begin, given);
        let checked = self.check_shared(py);
        begun?;
        checked?;
        Ok(controller.unbind())
    }

    /// Fails if the last call of the controller changed a variable that other robots of this process can read.
    fn check_shared(&self, py: Python<'_>) -> PyResult<()> {
        if let Some(shared) = &self.common.shared {
            shared.call_method0(py, intern!(py, "check"))?;
        }
        Ok(())
    }

    /// Returns whether any controller of the run has failed. All controllers then stop.
    pub fn has_failed(&self) -> bool {
        self.common.failure.is_stored()
    }

    /// Returns a successful result. Stores an error as one line with the robot, the tick and the position.
    pub fn store_error<T>(&self, py: Python<'_>, tick: u64, result: PyResult<T>) -> Option<T> {
        let error = match result {
            Ok(result) => return Some(result),
            Err(error) => error,
        };
        if matches!(self.common.failure, FailureReaction::Stored(_))
            && !error.is_instance_of::<PyException>(py)
        {
            // Ctrl-C and `sys.exit` end the caller's program, not a controller.
            self.common.failure.note(py, error);
            return None;
        }
        let name = self.common.setup.roster.name(self.me);
        // The traceback is in the `PyErr`, but not in its value.
        let value = error.value(py);
        let line = value
            .setattr("__traceback__", error.traceback(py))
            .and_then(|()| py.import("alliance_sim._controllers"))
            .and_then(|module| module.call_method1("line_of", (name, tick, value)))
            .and_then(|text| text.extract::<String>());
        let failed = ControllerError::new_err(line.unwrap_or_else(|_| error.to_string()));
        failed.set_cause(py, Some(error));
        self.common.failure.note(py, failed);
        None
    }

    /// Sets an attribute of the object, if there is one.
    pub fn set_attribute<'py>(
        &self,
        py: Python<'py>,
        name: &Bound<'py, PyString>,
        value: impl IntoPyObject<'py>,
    ) -> PyResult<()> {
        self.controller.as_ref().map_or(Ok(()), |controller| {
            controller.bind(py).setattr(name, value)
        })
    }

    /// Calls `step` of the object with its arguments and the received messages. Returns `None` if there is no object.
    pub fn step<'py>(
        &self,
        py: Python<'py>,
        draws: RandomDraws,
        given: impl FnOnce(Bound<'py, PyList>) -> PyResult<Bound<'py, PyTuple>>,
        received: &[Arc<Broadcast>],
    ) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        let Some(controller) = &self.controller else {
            return Ok(None);
        };
        let controller = controller.bind(py).clone();
        self.stream.get().begin(draws);
        let mission = self.common.setup.catalog.mission.name();
        let received = received
            .iter()
            .filter_map(|message| Message::from_broadcast(message, self.common.name, mission))
            .map(|message| Bound::new(py, message));
        let received = PyList::new(py, received.collect::<PyResult<Vec<_>>>()?)?;
        let given = given(received)?;
        let done = if self.common.twice {
            let module = py.import(intern!(py, "alliance_sim._controllers"))?;
            module.call_method1(intern!(py, "step_twice"), (&controller, given))
        } else {
            controller.call_method1(intern!(py, "step"), given)
        };
        // A failed step can have changed variables, too, which the check notes for later runs. The error of the step is
        // reported.
        let checked = self.check_shared(py);
        let done = done?;
        checked?;
        Ok(Some((controller, done)))
    }

    /// Removes and returns the messages that the object has sent to teammates.
    pub fn take_messages(&self, controller: &Bound<'_, PyAny>) -> PyResult<Vec<AllocationMessage>> {
        let sent = controller.getattr(intern!(controller.py(), "_outbox"))?;
        let sent = sent.cast::<PyList>()?;
        let messages = sent.iter().map(|message| {
            let bytes = message.cast::<PyBytes>()?.as_bytes().to_vec();
            let schema = self.common.name.to_owned();
            Ok(AllocationMessage::Open(OpenMessage { schema, bytes }))
        });
        let messages = messages.collect::<PyResult<Vec<_>>>()?;
        if !sent.is_empty() {
            sent.del_slice(0, sent.len())?;
        }
        Ok(messages)
    }
}
