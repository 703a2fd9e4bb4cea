//! A controller written in Python: it receives sensor readings and messages, and returns an action.
//!
//! In the engine it consists of two parts. A mission's controller marks the current behavior of the Python object as
//! the only applicable one, and an allocator always chooses that behavior. Heartbeats and state changes then work as
//! for all other robots.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use missions::external::MissionAction;
use proto::allocation::AllocationMessage;
use proto::mission::Action;
use proto::mission::items::Gripper;
use proto::readings::Actuation;
use proto::team::Broadcast;
use proto::telemetry::{Note, NoteKind};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use robot_agent::allocator::{Allocator, Decision, Input, OwnBehavior, RandomDraws, SelfState};
use robot_agent::mission::{ControllerInput, MissionController, Perception, StepOutput};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};

use crate::controller::{ClassData, ControllerObject};
use crate::readings;
use crate::rows::rows;

/// Messages to teammates in a step, passed from the mission part to the allocator part.
type Outbox = Arc<Mutex<Vec<AllocationMessage>>>;

/// The controllers of one Python class in a run.
#[derive(Debug)]
pub struct PythonAgents {
    common: Arc<ClassData>,
    outboxes: Mutex<BTreeMap<RobotId, Outbox>>,
}

impl PythonAgents {
    pub fn new(common: Arc<ClassData>) -> Self {
        Self {
            common,
            outboxes: Mutex::default(),
        }
    }

    /// Creates the controller of a robot at the start of an incarnation.
    pub fn controller(&self, robot: RobotId, setup: &Setup) -> PythonController {
        let behaviors = OwnBehavior::of_robot(robot, setup);
        PythonController {
            object: ControllerObject::new(robot, &behaviors, &self.common),
            outbox: self.outbox_of(robot),
            is_laden: false,
            result: StepResult::default(),
        }
    }

    fn outbox_of(&self, robot: RobotId) -> Outbox {
        let outbox = lock(&self.outboxes).entry(robot).or_default().clone();
        lock(&outbox).clear();
        outbox
    }
}

/// A panic ends the process, so a poisoned lock does not occur.
fn lock<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
    place.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The allocator that follows the decision of the Python object.
#[derive(Clone, Debug)]
pub struct FollowingAllocator {
    me: RobotId,
    outbox: Outbox,
}

impl Allocator for FollowingAllocator {
    type Config = PythonAgents;

    fn new(me: &SelfState, agents: &PythonAgents) -> Self {
        Self {
            me: me.robot,
            outbox: agents.outbox_of(me.robot),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let mut choices = input.choices.iter();
        let doing = choices.find(|choice| choice.applicable);
        decision.active = doing.map(|choice| choice.behavior);
        decision.say.append(&mut lock(&self.outbox));
        if decision.active.is_some() {
            rows(self.me, input, decision, |_| None);
        }
    }
}

/// The mission part of a controller written in Python.
#[derive(Clone, Debug)]
pub struct PythonController {
    object: ControllerObject,
    outbox: Outbox,
    is_laden: bool,
    result: StepResult,
}

/// The result of a step.
#[derive(Clone, Debug, Default)]
struct StepResult {
    actuation: Actuation,
    doing: Option<BehaviorId>,
    progressed: Option<TaskId>,
}

/// The fields of `alliance_sim.Action`.
#[derive(FromPyObject)]
struct ActionFields {
    speed: f32,
    turn: f32,
    gripper: String,
    report: bool,
    work: Option<u32>,
    read: Option<u32>,
    watch: bool,
    doing: Option<String>,
    progress: bool,
}

/// Returns the error of a value that does not fit a field of an action, with the name that users see.
fn field_error(error: PyErr) -> PyErr {
    let text = error.to_string();
    let Some((_, field)) = text.rsplit_once("ActionFields.") else {
        return error;
    };
    let form = match field {
        "work" | "read" => "None or a whole number from 0 to 4294967295",
        "report" | "watch" | "progress" => "True or False",
        "gripper" => "a text",
        "doing" => "None or a text",
        _ => "a number",
    };
    PyTypeError::new_err(format!(
        "Action: the value of {field} does not fit; write {form}"
    ))
}

impl MissionController for PythonController {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.is_laden = input.readings.mission.items().holding == Some(true);
        let tick = input.now.0 / self.object.common.setup.scenario.step_ms;
        self.result = if self.object.has_failed() {
            StepResult::default()
        } else {
            Python::attach(|py| {
                let stepped = self.try_step(py, input, tick, received);
                self.object
                    .store_error(py, tick, stepped)
                    .unwrap_or_default()
            })
        };
        let is_current = |behavior: &OwnBehavior| self.result.doing == Some(behavior.id);
        perception
            .applicable
            .extend(input.behaviors.iter().map(is_current));
        if let Some(task) = self.result.progressed {
            let catalog = &self.object.common.setup.catalog;
            perception.progressed.push(task);
            perception.notes.push(Note {
                kind: NoteKind::Progress,
                detail: catalog.task_name(task).to_owned(),
            });
        }
    }

    fn act(&mut self, _: &ControllerInput<'_>, _: Option<BehaviorId>, output: &mut StepOutput) {
        output.actuation = self.result.actuation;
    }

    fn is_laden(&self) -> bool {
        self.is_laden
    }
}

impl PythonController {
    fn try_step(
        &self,
        py: Python<'_>,
        input: &ControllerInput<'_>,
        tick: u64,
        received: &[Arc<Broadcast>],
    ) -> PyResult<StepResult> {
        let setup = &self.object.common.setup;
        let draws = RandomDraws::new(setup.seed, self.object.me, tick);
        let arguments = |received| {
            let readings = readings::to_python(py, input.readings, setup)?;
            (input.now.as_secs_f64(), readings, received).into_pyobject(py)
        };
        let Some((controller, action)) = self.object.step(py, draws, arguments, received)? else {
            return Ok(StepResult::default());
        };
        let class = py.import(intern!(py, "alliance_sim._controllers"))?;
        if !action.is_instance(&class.getattr(intern!(py, "Action"))?)? {
            let class_name = action.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "step returned {class_name}; it must return an Action"
            )));
        }
        let result = self.step_result(&action.extract().map_err(field_error)?, input)?;
        controller.call_method1(
            intern!(py, "_send_all"),
            (action.getattr(intern!(py, "send"))?,),
        )?;
        *lock(&self.outbox) = self.object.take_messages(&controller)?;
        Ok(result)
    }

    fn step_result(
        &self,
        action: &ActionFields,
        input: &ControllerInput<'_>,
    ) -> PyResult<StepResult> {
        let wrong = |text: String| Err(PyValueError::new_err(text));
        for (name, value) in [("speed", action.speed), ("turn", action.turn)] {
            if !value.is_finite() {
                return wrong(format!(
                    "Action: {name} is {value}, which is not a finite number"
                ));
            }
        }
        let doing = match &action.doing {
            None => None,
            Some(name) => {
                let mut sets = self.object.sets.iter();
                let Some(set) = sets.find(|set| set.name == *name) else {
                    let names: Vec<&str> = self.object.sets.iter().map(|set| &*set.name).collect();
                    return wrong(format!(
                        "Action: doing '{name}' is not one of the robot's sets; the sets are {}",
                        names.join(", ")
                    ));
                };
                Some(set)
            }
        };
        if action.progress && doing.is_none() {
            return wrong("Action: progress needs a set; state `doing`".to_owned());
        }
        Ok(StepResult {
            actuation: Actuation {
                speed_m_s: action.speed,
                turn_rad_s: action.turn,
                action: self.mission_action(action, input)?,
            },
            doing: doing.map(|set| set.id),
            progressed: doing.filter(|_| action.progress).map(|set| set.task),
        })
    }

    /// Returns the action besides driving, in the form of the mission.
    fn mission_action(
        &self,
        action: &ActionFields,
        input: &ControllerInput<'_>,
    ) -> PyResult<Action> {
        let gripper = match action.gripper.as_str() {
            "keep" => Gripper::Keep,
            "pick" => Gripper::Pick,
            "drop" => Gripper::Drop,
            other => {
                return Err(PyValueError::new_err(format!(
                    "Action: gripper is '{other}'; use 'keep', 'pick' or 'drop'"
                )));
            }
        };
        let action = MissionAction {
            gripper,
            report: action.report,
            work: action.work,
            read: action.read,
            watch: action.watch,
        };
        let mission = self.object.common.setup.catalog.mission.name();
        Ok(action.for_mission(mission, input.readings))
    }
}
