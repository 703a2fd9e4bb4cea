//! The arguments of an allocator's step in Python. They are created for each step and are immutable.
//!
//! Their documentation is that of the stub `_engine.pyi`; a test compares both.

use std::sync::Arc;

use glam::Vec2;
use missions::external::knowledge_as_json;
use proto::allocation::{AllocationMessage, OpenMessage};
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use robot_agent::agent::payload_bytes;
use robot_agent::allocator::Choice;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

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

/// A behavior set of the robot in a step. The constructor is for tests of a controller.
#[pyclass(frozen, module = "alliance_sim")]
pub struct Set {
    definition: Arc<SetDefinition>,
    choice: Choice,
    place: Option<Vec2>,
    /// The estimated travel time to the place, s.
    travel_s: Option<f64>,
    active: bool,
    since: SimTime,
}

impl Set {
    pub fn new(
        definition: Arc<SetDefinition>,
        choice: Choice,
        (place, travel_s): (Option<Vec2>, Option<f64>),
        active: bool,
        since: SimTime,
    ) -> Self {
        Self {
            definition,
            choice,
            place,
            travel_s,
            active,
            since,
        }
    }

    pub fn behavior(&self) -> BehaviorId {
        self.definition.id
    }

    /// Returns the travel time, s: 0 if the work has no place, and infinite without an estimate.
    fn travel_s(&self) -> f64 {
        match (self.place, self.choice.cost_s) {
            (None, Some(_)) => 0.0,
            _ => self.travel_s.unwrap_or(f64::INFINITY),
        }
    }
}

#[pymethods]
impl Set {
    #[new]
    #[pyo3(signature = (
        id, name, task, *, task_name = "", applicable = true, active = false, since = 0.0, cost = f64::INFINITY,
        reward = 1.0, round = 0.0, max_robots = 1, priority = 0, opens_in = 0.0, ceased_after = 10.0, values = None,
        place = None, travel = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn for_test(
        py: Python<'_>,
        id: u32,
        name: &str,
        task: u32,
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
        place: Option<(f32, f32)>,
        travel: Option<f64>,
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
            (place.map(Vec2::from), travel),
            active,
            SimTime::from_secs_f64(since),
        )
    }

    /// Id of the set, the same for all robots.
    #[getter]
    fn id(&self) -> u32 {
        self.definition.id.0
    }

    /// Name of the set.
    #[getter]
    fn name(&self) -> &str {
        &self.definition.name
    }

    /// Id of the set's task, an index of `Controller.tasks`.
    #[getter]
    fn task(&self) -> u32 {
        self.definition.task.0
    }

    /// Name of the set's task.
    #[getter]
    fn task_name(&self) -> &str {
        &self.definition.task_name
    }

    /// True if the set can be active in this step.
    #[getter]
    fn applicable(&self) -> bool {
        self.choice.applicable
    }

    /// True if the set was active at the end of the previous step.
    #[getter]
    fn active(&self) -> bool {
        self.active
    }

    /// Start of the present state, active or not, s.
    #[getter]
    fn since(&self) -> f64 {
        self.since.as_secs_f64()
    }

    /// Estimated time of one unit of work with travel and wait, s, from the robot's own knowledge; infinite without an estimate.
    #[getter]
    fn cost(&self) -> f64 {
        self.choice.cost_s.unwrap_or(f64::INFINITY)
    }

    /// Place to which the robot drives for the next unit of work, (x, y), m, from the robot's own knowledge; `None` without a known place.
    #[getter]
    fn place(&self) -> Option<(f32, f32)> {
        self.place.map(Into::into)
    }

    /// Estimated travel time to `place`, s, a part of `cost`; 0 for work without a place, infinite without an estimate.
    #[getter]
    fn travel(&self) -> f64 {
        self.travel_s()
    }

    /// Estimated time of one unit of work at `place`, s: `cost` without travel and wait; infinite without an estimate.
    #[getter]
    fn work(&self) -> f64 {
        let before_s = self.travel_s().max(self.choice.opens_in_s);
        match self.choice.cost_s {
            Some(cost_s) if before_s.is_finite() => (cost_s - before_s).max(0.0),
            _ => f64::INFINITY,
        }
    }

    /// Value of one unit of work, in the mission's own measure.
    #[getter]
    fn reward(&self) -> f64 {
        self.choice.reward
    }

    /// Time at which the task became due again, s. Messages about earlier rounds are void.
    #[getter]
    fn round(&self) -> f64 {
        self.choice.round.as_secs_f64()
    }

    /// Time until the work of the unit can begin, s. `cost` contains the wait.
    #[getter]
    fn opens_in(&self) -> f64 {
        self.choice.opens_in_s
    }

    /// Maximum number of robots that may perform the task at once.
    #[getter]
    fn max_robots(&self) -> usize {
        self.choice.max_robots
    }

    /// Priority of the task; a higher one goes first.
    #[getter]
    fn priority(&self) -> i32 {
        self.choice.priority
    }

    /// Time without messages after which a teammate counts as lost, s.
    #[getter]
    fn ceased_after(&self) -> f64 {
        self.definition.ceased_after_s
    }

    /// Values of all ALLIANCE parameters of the set, as in run.json.
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

/// A heartbeat of a teammate, or a message of a teammate of the same class. The constructor is for tests of a controller.
#[pyclass(frozen, module = "alliance_sim")]
pub struct Message {
    broadcast: Arc<Broadcast>,
    knowledge: Knowledge,
}

/// The source of a heartbeat's shared knowledge.
enum Knowledge {
    /// The bytes of the broadcast, in the form of this mission.
    Received(&'static str),
    /// The argument of the constructor.
    Stated(Option<Py<PyAny>>),
}

impl Message {
    /// Returns the message if it is a heartbeat or has the schema of the allocator. Other messages return `None`.
    pub fn from_broadcast(
        broadcast: &Arc<Broadcast>,
        allocator: &str,
        mission: &'static str,
    ) -> Option<Self> {
        let is_relevant = match &broadcast.body {
            BroadcastContent::Heartbeat(_) => true,
            BroadcastContent::Bulletin(_) => false,
            BroadcastContent::Allocation(AllocationMessage::Open(message)) => {
                message.schema == allocator
            }
            BroadcastContent::Allocation(_) => false,
        };
        is_relevant.then(|| Self {
            broadcast: Arc::clone(broadcast),
            knowledge: Knowledge::Received(mission),
        })
    }

    fn heartbeat(&self) -> Option<&Heartbeat> {
        match &self.broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => Some(heartbeat),
            _ => None,
        }
    }
}

#[pymethods]
impl Message {
    #[new]
    #[pyo3(signature = (
        sender, state = "idle", *, incarnation = 1, sent = 0.0, task = None, set = None, since = 0.0, progress = 0,
        position = None, carrying = false, content = None, shared_knowledge = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn for_test(
        sender: u32,
        state: &str,
        incarnation: u32,
        sent: f64,
        task: Option<u32>,
        set: Option<u32>,
        since: f64,
        progress: u32,
        position: Option<(f32, f32)>,
        carrying: bool,
        content: Option<&[u8]>,
        shared_knowledge: Option<Py<PyAny>>,
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
        Ok(Self {
            broadcast: Arc::new(Broadcast {
                sender: RobotId(sender),
                incarnation,
                tick: 0,
                index: 0,
                seq: 0,
                sent: SimTime::from_secs_f64(sent),
                body,
            }),
            knowledge: Knowledge::Stated(shared_knowledge),
        })
    }

    /// Rank of the sender, an index of `Controller.team`.
    #[getter]
    fn sender(&self) -> u32 {
        self.broadcast.sender.0
    }

    /// Incarnation of the sender, from 1.
    #[getter]
    fn incarnation(&self) -> u32 {
        self.broadcast.incarnation
    }

    /// Simulated time at which it was sent, s.
    #[getter]
    fn sent(&self) -> f64 {
        self.broadcast.sent.as_secs_f64()
    }

    /// `executing`, `waiting`, `idle` or `released`; `message` for a controller's own message, of which only `content` is set below.
    #[getter]
    fn state(&self) -> &'static str {
        self.heartbeat()
            .map_or("message", |heartbeat| heartbeat.state.as_str())
    }

    /// Id of the task; `None` when idle.
    #[getter]
    fn task(&self) -> Option<u32> {
        Some(self.heartbeat()?.task?.0)
    }

    /// Id of the behavior set; `None` when idle.
    #[getter]
    fn set(&self) -> Option<u32> {
        Some(self.heartbeat()?.set?.0)
    }

    /// Start of that state, s.
    #[getter]
    fn since(&self) -> f64 {
        let since = self
            .heartbeat()
            .map_or(self.broadcast.sent, |heartbeat| heartbeat.since);
        since.as_secs_f64()
    }

    /// Number of effects on the task so far.
    #[getter]
    fn progress(&self) -> u32 {
        self.heartbeat().map_or(0, |heartbeat| heartbeat.progress)
    }

    /// Position of the sender by its own estimate, (x, y), m.
    #[getter]
    fn position(&self) -> Option<(f32, f32)> {
        Some(self.heartbeat()?.position?.into())
    }

    /// True if the sender carries an item.
    #[getter]
    fn carrying(&self) -> bool {
        self.heartbeat().is_some_and(|heartbeat| heartbeat.carrying)
    }

    /// Size of the message on the bus, bytes, with its seal. A message of the constructor has no shared knowledge in it.
    #[getter]
    fn size(&self) -> u32 {
        payload_bytes(&self.broadcast)
    }

    /// Shared knowledge of the sender, in the mission's own form with the names of docs/WIRE.md; `None` without any.
    #[getter]
    fn shared_knowledge<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let mission = match &self.knowledge {
            Knowledge::Received(mission) => *mission,
            Knowledge::Stated(stated) => {
                return Ok(stated.as_ref().map(|stated| stated.bind(py).clone()));
            }
        };
        let Some(heartbeat) = self.heartbeat() else {
            return Ok(None);
        };
        let known = knowledge_as_json(&heartbeat.shared_knowledge, mission);
        loads(py, &known.to_string()).map(Some)
    }

    /// Content of the controller's own message.
    #[getter]
    fn content<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        match &self.broadcast.body {
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
            self.broadcast.sender.0,
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
