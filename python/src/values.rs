//! The arguments of an allocator's step in Python. They are created for each step and are immutable.

use std::sync::{Arc, Mutex, PoisonError};

use proto::allocation::AllocationMessage;
use proto::team::{Broadcast, BroadcastContent, Heartbeat};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use robot_agent::allocator::{Choice, RandomDraws};
use scenario::ids::{BehaviorId, TaskId};
use scenario::time::SimTime;

use crate::errors::alliance_error;

/// Constant data of one of the robot's behavior sets.
#[derive(Debug)]
pub struct SetDefinition {
    pub id: BehaviorId,
    pub name: String,
    pub task: TaskId,
    pub task_name: String,
    pub ceased_after_s: f64,
    /// The ALLIANCE values in force, from the setup.
    pub values: Py<PyAny>,
}

/// A behavior set of the robot in a step.
#[pyclass(frozen, module = "alliance_sim")]
pub struct Set {
    definition: Arc<SetDefinition>,
    choice: Choice,
    active: bool,
    since: SimTime,
}

impl Set {
    pub fn new(
        definition: Arc<SetDefinition>,
        choice: Choice,
        active: bool,
        since: SimTime,
    ) -> Self {
        Self {
            definition,
            choice,
            active,
            since,
        }
    }

    pub fn behavior(&self) -> BehaviorId {
        self.definition.id
    }
}

#[pymethods]
impl Set {
    #[getter]
    fn id(&self) -> u16 {
        self.definition.id.0
    }

    #[getter]
    fn name(&self) -> &str {
        &self.definition.name
    }

    #[getter]
    fn task(&self) -> u16 {
        self.definition.task.0
    }

    #[getter]
    fn task_name(&self) -> &str {
        &self.definition.task_name
    }

    #[getter]
    fn applicable(&self) -> bool {
        self.choice.applicable
    }

    #[getter]
    fn active(&self) -> bool {
        self.active
    }

    #[getter]
    fn since(&self) -> f64 {
        self.since.as_secs_f64()
    }

    #[getter]
    fn cost(&self) -> f64 {
        self.choice.cost_s.unwrap_or(f64::INFINITY)
    }

    #[getter]
    fn reward(&self) -> f64 {
        self.choice.reward
    }

    #[getter]
    fn round(&self) -> f64 {
        self.choice.round.as_secs_f64()
    }

    #[getter]
    fn max_robots(&self) -> usize {
        self.choice.max_robots
    }

    #[getter]
    fn priority(&self) -> i32 {
        self.choice.priority
    }

    #[getter]
    fn ceased_after(&self) -> f64 {
        self.definition.ceased_after_s
    }

    #[getter]
    fn values(&self, py: Python<'_>) -> Py<PyAny> {
        self.definition.values.clone_ref(py)
    }

    fn __repr__(&self) -> String {
        format!(
            "<Set {} {}{}{}>",
            self.definition.id.0,
            self.definition.name,
            if self.choice.applicable {
                ", applicable"
            } else {
                ""
            },
            if self.active { ", active" } else { "" }
        )
    }
}

/// A received heartbeat of a teammate, or a message of its allocator.
#[pyclass(frozen, module = "alliance_sim")]
pub struct Message(Arc<Broadcast>);

impl Message {
    /// Returns the message if it is a heartbeat or has the schema of the allocator. Other messages return `None`.
    pub fn from_broadcast(broadcast: &Arc<Broadcast>, allocator: &str) -> Option<Self> {
        let is_relevant = match &broadcast.body {
            BroadcastContent::Heartbeat(_) => true,
            BroadcastContent::Bulletin(_) => false,
            BroadcastContent::Allocation(AllocationMessage::Open(message)) => {
                message.schema == allocator
            }
            BroadcastContent::Allocation(_) => false,
        };
        is_relevant.then(|| Self(Arc::clone(broadcast)))
    }

    fn heartbeat(&self) -> Option<&Heartbeat> {
        match &self.0.body {
            BroadcastContent::Heartbeat(heartbeat) => Some(heartbeat),
            _ => None,
        }
    }
}

#[pymethods]
impl Message {
    #[getter]
    fn sender(&self) -> u16 {
        self.0.sender.0
    }

    #[getter]
    fn incarnation(&self) -> u32 {
        self.0.incarnation
    }

    #[getter]
    fn sent(&self) -> f64 {
        self.0.sent.as_secs_f64()
    }

    #[getter]
    fn state(&self) -> &'static str {
        self.heartbeat()
            .map_or("message", |heartbeat| heartbeat.state.as_str())
    }

    #[getter]
    fn task(&self) -> Option<u16> {
        Some(self.heartbeat()?.task?.0)
    }

    #[getter]
    fn set(&self) -> Option<u16> {
        Some(self.heartbeat()?.set?.0)
    }

    #[getter]
    fn since(&self) -> f64 {
        let since = self
            .heartbeat()
            .map_or(self.0.sent, |heartbeat| heartbeat.since);
        since.as_secs_f64()
    }

    #[getter]
    fn progress(&self) -> u32 {
        self.heartbeat().map_or(0, |heartbeat| heartbeat.progress)
    }

    #[getter]
    fn position(&self) -> Option<(f32, f32)> {
        Some(self.heartbeat()?.position?.into())
    }

    #[getter]
    fn carrying(&self) -> bool {
        self.heartbeat().is_some_and(|heartbeat| heartbeat.carrying)
    }

    #[getter]
    fn shared_knowledge<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(heartbeat) = self.heartbeat() else {
            return Ok(None);
        };
        let text = serde_json::to_string(&heartbeat.shared_knowledge).map_err(alliance_error)?;
        loads(py, &text).map(Some)
    }

    #[getter]
    fn content<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        match &self.0.body {
            BroadcastContent::Allocation(AllocationMessage::Open(message)) => {
                PyBytes::new(py, &message.bytes)
            }
            _ => PyBytes::new(py, b""),
        }
    }

    fn __repr__(&self) -> String {
        format!(
            "<Message {} from {} at {} s>",
            self.state(),
            self.0.sender.0,
            self.sent()
        )
    }
}

/// Parses JSON into Python objects.
pub fn loads<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}

/// The random numbers of a robot's allocator for the current step.
#[pyclass(frozen, module = "alliance_sim")]
pub struct Stream(Mutex<StepState>);

struct StepState {
    draws: Option<RandomDraws>,
    /// The generator, created for the first number.
    stream: Option<ChaCha8Rng>,
    drawn: u32,
}

impl Stream {
    /// The largest number of 64-bit values in a step.
    const MOST: u32 = 2048;

    pub fn new() -> Self {
        Self(Mutex::new(StepState {
            draws: None,
            stream: None,
            drawn: 0,
        }))
    }

    /// Starts a new step.
    pub fn begin(&self, draws: RandomDraws) {
        let mut step = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *step = StepState {
            draws: Some(draws),
            stream: None,
            drawn: 0,
        };
    }
}

#[pymethods]
impl Stream {
    /// Restarts the current step with the same numbers.
    fn begin_again(&self) {
        let mut step = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        (step.stream, step.drawn) = (None, 0);
    }

    fn next_u64(&self) -> PyResult<u64> {
        let mut step = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(draws) = step.draws else {
            let why = "random numbers are available only within a step";
            return Err(PyRuntimeError::new_err(why));
        };
        step.drawn += 1;
        if step.drawn > Self::MOST {
            let why = format!("a step has at most {} random numbers", Self::MOST);
            return Err(PyRuntimeError::new_err(why));
        }
        let stream = step.stream.get_or_insert_with(|| draws.stream());
        Ok(stream.next_u64())
    }
}
