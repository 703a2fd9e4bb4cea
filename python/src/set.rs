//! The behavior sets that an allocator in Python chooses from. They are created for each step and are immutable.
//!
//! Their documentation is that of the stub `_engine.pyi`; a test compares both.

use std::sync::Arc;

use glam::Vec2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use robot_agent::allocator::Choice;
use scenario::ids::{BehaviorId, TaskId};
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

    fn __eq__(&self, other: &Self, py: Python<'_>) -> PyResult<bool> {
        let state = |set: &Self| (set.choice, set.place, set.travel_s, set.active, set.since);
        let (one, another) = (&self.definition, &other.definition);
        let constants = |set: &SetDefinition| (set.id, set.task, set.ceased_after_s);
        Ok(state(self) == state(other)
            && (Arc::ptr_eq(one, another)
                || constants(one) == constants(another)
                    && (&one.name, &one.task_name) == (&another.name, &another.task_name)
                    && one.values.bind(py).eq(&another.values)?))
    }

    fn __hash__(&self) -> u64 {
        u64::from(self.definition.id.0)
    }

    fn __copy__(this: Py<Self>) -> Py<Self> {
        this
    }

    fn __deepcopy__(this: Py<Self>, _memo: Py<PyAny>) -> Py<Self> {
        this
    }

    /// Returns the arguments of the constructor, for pickle.
    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(SetArguments<'_>, Bound<'py, PyDict>)> {
        let Self {
            definition, choice, ..
        } = self;
        let named = PyDict::new(py);
        named.set_item("task_name", &definition.task_name)?;
        named.set_item("applicable", choice.applicable)?;
        named.set_item("active", self.active)?;
        named.set_item("since", self.since())?;
        named.set_item("cost", self.cost())?;
        named.set_item("reward", choice.reward)?;
        named.set_item("round", self.round())?;
        named.set_item("max_robots", choice.max_robots)?;
        named.set_item("priority", choice.priority)?;
        named.set_item("opens_in", choice.opens_in_s)?;
        named.set_item("ceased_after", definition.ceased_after_s)?;
        named.set_item("values", &definition.values)?;
        named.set_item("place", self.place())?;
        named.set_item("travel", self.travel_s)?;
        Ok(((self.id(), &definition.name, self.task()), named))
    }
}

/// The positional arguments of the constructor of [`Set`]: id, name, task.
type SetArguments<'s> = (u32, &'s str, u32);

/// Parses JSON into Python objects.
pub fn loads<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}
