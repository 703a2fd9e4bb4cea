//! The messages that a controller in Python receives. They are created for each step and are immutable.
//!
//! Their documentation is that of the stub `_engine.pyi`; a test compares both.

use std::sync::Arc;

use missions::external::knowledge_as_json;
use proto::allocation::{AllocationMessage, OpenMessage};
use proto::codec::{decode, encode};
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use robot_agent::agent::payload_bytes;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use crate::controller_class::interned;
use crate::set::loads;

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

    fn __eq__(&self, other: &Self, py: Python<'_>) -> PyResult<bool> {
        let is_knowledge_equal = match (&self.knowledge, &other.knowledge) {
            (Knowledge::Received(one), Knowledge::Received(another)) => one == another,
            (Knowledge::Stated(None), Knowledge::Stated(None)) => true,
            (Knowledge::Stated(Some(one)), Knowledge::Stated(Some(another))) => {
                one.bind(py).eq(another)?
            }
            _ => false,
        };
        Ok(is_knowledge_equal && self.broadcast == other.broadcast)
    }

    fn __hash__(&self) -> u64 {
        self.broadcast.sent.0 ^ (u64::from(self.broadcast.sender.0) << 32)
    }

    fn __copy__(this: Py<Self>) -> Py<Self> {
        this
    }

    fn __deepcopy__(this: Py<Self>, _memo: Py<PyAny>) -> Py<Self> {
        this
    }

    /// Returns the call that pickle repeats.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, PickledMessage)> {
        let restore = py
            .import("alliance_sim._engine")?
            .getattr("restored_message")?;
        let bytes =
            encode(&*self.broadcast).map_err(|error| PyValueError::new_err(error.to_string()))?;
        let (mission, stated) = match &self.knowledge {
            Knowledge::Received(mission) => (Some((*mission).to_owned()), None),
            Knowledge::Stated(stated) => (None, stated.as_ref().map(|one| one.clone_ref(py))),
        };
        Ok((
            restore,
            (PyBytes::new(py, &bytes).unbind(), mission, stated),
        ))
    }
}

/// The encoded broadcast, the mission of a received message, and the shared knowledge of one for a test.
type PickledMessage = (Py<PyBytes>, Option<String>, Option<Py<PyAny>>);

/// Returns a message from its pickled parts.
///
/// # Errors
/// If the bytes are no broadcast.
#[pyfunction]
pub fn restored_message(
    bytes: &[u8],
    mission: Option<&str>,
    stated: Option<Py<PyAny>>,
) -> PyResult<Message> {
    let broadcast = decode(bytes)
        .map_err(|error| PyValueError::new_err(format!("a pickled Message is damaged: {error}")))?;
    let knowledge = match mission {
        Some(mission) => Knowledge::Received(interned(mission)),
        None => Knowledge::Stated(stated),
    };
    Ok(Message {
        broadcast: Arc::new(broadcast),
        knowledge,
    })
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
