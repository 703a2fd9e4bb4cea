//! The arguments of an allocator's step in Python. They are created for each step and are immutable.

use std::sync::Arc;

use proto::allocation::{AllocationMessage, OpenMessage};
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use robot_agent::allocator::Choice;
use scenario::ids::{BehaviorId, RobotId, TaskId};
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
    /// Creates a set for a test of a controller.
    #[new]
    #[pyo3(signature = (
        id, name, task, *, task_name = "", applicable = true, active = false, since = 0.0, cost = f64::INFINITY,
        reward = 1.0, round = 0.0, max_robots = 1, priority = 0, opens_in = 0.0, ceased_after = 10.0, values = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn for_test(
        py: Python<'_>,
        id: u16,
        name: &str,
        task: u16,
        task_name: &str,
        applicable: bool,
        active: bool,
        since: f64,
        cost: f64,
        reward: f64,
        round: f64,
        max_robots: usize,
        priority: i32,
        opens_in: f64,
        ceased_after: f64,
        values: Option<Py<PyAny>>,
    ) -> Self {
        let definition = SetDefinition {
            id: BehaviorId(id),
            name: name.to_owned(),
            task: TaskId(task),
            task_name: task_name.to_owned(),
            ceased_after_s: ceased_after,
            values: values.unwrap_or_else(|| PyDict::new(py).into_any().unbind()),
        };
        let choice = Choice {
            behavior: BehaviorId(id),
            task: TaskId(task),
            round: SimTime::from_secs_f64(round),
            applicable,
            cost_s: Some(cost).filter(|cost| cost.is_finite()),
            opens_in_s: opens_in,
            reward,
            priority,
            max_robots,
        };
        Self::new(
            Arc::new(definition),
            choice,
            active,
            SimTime::from_secs_f64(since),
        )
    }

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
    fn opens_in(&self) -> f64 {
        self.choice.opens_in_s
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
    /// Creates a heartbeat, or with `content` a message of a controller, for a test of a controller.
    #[new]
    #[pyo3(signature = (
        sender, state = "idle", *, incarnation = 1, sent = 0.0, task = None, set = None, since = 0.0, progress = 0,
        position = None, carrying = false, content = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn for_test(
        sender: u16,
        state: &str,
        incarnation: u32,
        sent: f64,
        task: Option<u16>,
        set: Option<u16>,
        since: f64,
        progress: u32,
        position: Option<(f32, f32)>,
        carrying: bool,
        content: Option<&[u8]>,
    ) -> PyResult<Self> {
        let body = match content {
            Some(bytes) => BroadcastContent::Allocation(AllocationMessage::Open(OpenMessage {
                schema: String::new(),
                bytes: bytes.to_vec(),
            })),
            None => BroadcastContent::Heartbeat(Heartbeat {
                state: state_named(state)?,
                since: SimTime::from_secs_f64(since),
                set: set.map(BehaviorId),
                task: task.map(TaskId),
                progress,
                position: position.map(Into::into),
                carrying,
                shared_knowledge: SharedKnowledge::Nothing,
            }),
        };
        Ok(Self(Arc::new(Broadcast {
            sender: RobotId(sender),
            incarnation,
            tick: 0,
            index: 0,
            seq: 0,
            sent: SimTime::from_secs_f64(sent),
            body,
        })))
    }

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

fn state_named(name: &str) -> PyResult<TaskState> {
    let known = [
        TaskState::Executing,
        TaskState::Waiting,
        TaskState::Idle,
        TaskState::Released,
    ];
    let found = known.into_iter().find(|state| state.as_str() == name);
    found.ok_or_else(|| {
        let known = known.map(TaskState::as_str).join(", ");
        PyValueError::new_err(format!("state: there is no '{name}'; use one of {known}"))
    })
}

/// Parses JSON into Python objects.
pub fn loads<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}
