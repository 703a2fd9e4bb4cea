//! The robots' side of a mission: the controller of one robot.
//!
//! A [`MissionController`] derives the applicable behaviors from sensor readings and received broadcasts, and executes
//! the behavior that the allocator selected. The framework adds links, heartbeats, the allocator, and the rollback of
//! steps that did not count. A [`ControllerKind`] registers a controller for its mission.
//!
//! # Guarantees and obligations
//! - A step calls [`MissionController::perceive`], then [`MissionController::choices`] if the allocator weighs costs,
//!   then [`MissionController::act`], all with the same [`ControllerInput`].
//! - A controller uses only its inputs: no clock, file, global or thread. Equal inputs give equal steps on every
//!   machine.
//! - The value contains the entire state. A clone is a checkpoint, which the robot restores if a step did not count.
//! - A message sent at tick *t* arrives at *t* + 1 or later, possibly twice, or never. Any robot can send any content.
//! - Numbers in the output are finite. A controller that panics or commands a speed of NaN ends its robot.

#![warn(missing_docs)]

pub mod prelude;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::fmt::{self, Debug};
use std::sync::Arc;

use glam::Vec2;
use prefetch::Layer;
use proto::mission::{Reading, SharedKnowledge};
use proto::readings::{Actuation, Readings};
use proto::team::{Broadcast, Bulletin};
use proto::telemetry::Note;
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::mission::registry::Mission;
use scenario::time::SimTime;

use crate::allocator::{Choice, OwnBehavior};

/// The controller of one robot for a mission; a pure function of its inputs.
///
/// The mission's own types are plain types with serde. On the bus they have at most
/// [`MAX_READING_BYTES`](proto::mission::MAX_READING_BYTES), [`MAX_ACTION_BYTES`](proto::mission::MAX_ACTION_BYTES) and
/// [`MAX_KNOWLEDGE_BYTES`](proto::mission::MAX_KNOWLEDGE_BYTES).
///
/// ```
/// use robot_agent::agent::{Agent, TeamConfig};
/// use robot_agent::mission::prelude::*;
/// use robot_agent::registry::AgentRegistry;
/// use scenario::testkit::{DRILL, default_setup};
/// use serde::{Deserialize, Serialize};
///
/// /// Rings a bell ten times for its task. Heartbeats contain the count.
/// #[derive(Clone, Debug)]
/// struct Ringer {
///     rung: u32,
/// }
///
/// #[derive(Serialize, Deserialize)]
/// struct Ring;
///
/// impl MissionController for Ringer {
///     fn perceive(&mut self, input: &ControllerInput, _: &[Arc<Broadcast>], perception: &mut Perception) {
///         perception.applicable.extend(input.behaviors.iter().map(|_| self.rung < 10));
///     }
///
///     fn act(&mut self, input: &ControllerInput, active: Option<BehaviorId>, output: &mut StepOutput) {
///         if input.task_of(active).is_some() {
///             self.rung += 1;
///             output.actuation.action = Action::new(&Ring);
///         }
///     }
///
///     fn shared_knowledge(&self, _: &ControllerInput, knowledge: &mut SharedKnowledge) {
///         knowledge.set(&self.rung);
///     }
/// }
///
/// // The drill is a mission for tests, which supplies the tasks and behaviors.
/// let ringers = ControllerKind::new(DRILL, |_| ControllerConstructor::new(|_, _| Ringer { rung: 0 }));
/// let registry = AgentRegistry::built_in().with_mission(ringers);
/// let setup = default_setup(1);
/// let team = TeamConfig::new(&setup.for_robots(), &registry)?;
/// let blue = Agent::new(RobotId(0), 1, &setup.for_robots(), &team);
/// # Ok::<(), robot_agent::allocator::ConfigError>(())
/// ```
pub trait MissionController: CloneController + Debug + Send + 'static {
    /// Runs the first part of a step: merges readings and broadcasts into the state. `received` contains the broadcasts
    /// that arrived in this step, sorted by sender, incarnation and sequence number. `perception` is empty at the start.
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    );

    /// Requests the memory of the next step: the fields at [`Layer::Elements`], and their lists at [`Layer::Contents`]. A batch of
    /// environments calls this while other environments step. The default requests nothing.
    fn prefetch(&self, _layer: Layer) {}

    /// Adds one choice per behavior, in the order of [`ControllerInput::behaviors`]. `applicable` is that of the
    /// perception, in the same order. Costs and rewards are finite. By default all units have the reward 1, the cost is
    /// [`seconds`](Self::seconds), and the round is [`round`](Self::round).
    fn choices(&self, input: &ControllerInput<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        let from = self.position(input);
        for (behavior, &applicable) in input.behaviors.iter().zip(applicable) {
            choices.push(Choice {
                behavior: behavior.id,
                task: behavior.task,
                round: self.round(input, behavior.task),
                applicable,
                cost_s: self.seconds(from, &[], behavior.task),
                opens_in_s: 0.0,
                reward: 1.0,
                priority: behavior.priority,
                max_robots: behavior.max_robots,
            });
        }
    }

    /// Returns the start of the task's current round, at most the current time; see [`Choice::round`]. By default a task
    /// is due only once, from the start.
    fn round(&self, input: &ControllerInput<'_>, task: TaskId) -> SimTime {
        let _ = (input, task);
        SimTime::ZERO
    }

    /// Returns the estimated duration of a unit of `task` after one unit of each task of `after`, s, at least 0; `None`
    /// without an estimate. `from` is the robot's [`position`](Self::position), m. By default there is no estimate.
    fn seconds(&self, from: Option<Vec2>, after: &[TaskId], task: TaskId) -> Option<f64> {
        let _ = (from, after, task);
        None
    }

    /// Returns the place to which a robot at `from` drives for the next unit of a task, m, finite. By default no place is
    /// known.
    fn place(&self, from: Option<Vec2>, task: TaskId) -> Option<Vec2> {
        let _ = (from, task);
        None
    }

    /// Returns the estimated travel time from `from` to that [`place`](Self::place), s, at least 0. It is a part of
    /// [`seconds`](Self::seconds). By default there is no estimate.
    fn travel_s(&self, from: Option<Vec2>, task: TaskId) -> Option<f64> {
        let _ = (from, task);
        None
    }

    /// Runs the last part of a step: computes the action of the `active` behavior, or the motion of an idle robot.
    /// `output` is empty at the start, so that a robot without an action stands still.
    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    );

    /// Writes the shared knowledge for a heartbeat, after [`act`](Self::act). `knowledge` contains an old value whose
    /// memory can be reused. By default robots share nothing.
    fn shared_knowledge(&self, input: &ControllerInput<'_>, knowledge: &mut SharedKnowledge) {
        let _ = input;
        *knowledge = SharedKnowledge::Nothing;
    }

    /// Returns the estimated position of the robot, m, finite; `None` without an estimate. By default it is the reading
    /// of the position sensor.
    fn position(&self, input: &ControllerInput<'_>) -> Option<Vec2> {
        input.position()
    }

    /// Returns whether the robot carries an object of its task. By default it never does.
    fn is_laden(&self) -> bool {
        false
    }
}

/// Copies the controller behind a [`MissionController`] object. Each controller with `Clone` has it.
pub trait CloneController {
    /// Returns a copy of the state.
    fn clone_box(&self) -> Box<dyn MissionController>;
}

impl<C: MissionController + Clone> CloneController for C {
    fn clone_box(&self) -> Box<dyn MissionController> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn MissionController> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

/// The constructor of the controllers of a run. It exists once per process and can contain data that all robots share.
#[derive(Clone)]
pub struct ControllerConstructor(Arc<Construct>);

/// Creates the controller of a robot.
type Construct = dyn Fn(RobotId, &Setup) -> Box<dyn MissionController> + Send + Sync;

impl ControllerConstructor {
    /// Wraps a function that creates the controller of a robot at the start of an incarnation, without knowledge beyond
    /// the setup. The scenario is valid.
    #[must_use]
    pub fn new<C: MissionController>(
        new: impl Fn(RobotId, &Setup) -> C + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(move |robot, setup| Box::new(new(robot, setup))))
    }

    pub(crate) fn create(&self, robot: RobotId, setup: &Setup) -> Box<dyn MissionController> {
        (self.0)(robot, setup)
    }
}

impl Debug for ControllerConstructor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ControllerConstructor")
    }
}

/// The robots' side of a mission in a registry.
#[derive(Clone, Copy, Debug)]
pub struct ControllerKind {
    /// The mission that the controllers belong to.
    pub data: Mission,
    /// Creates the constructor of a run.
    pub constructor: fn(&Setup) -> ControllerConstructor,
    /// Returns the cost of one unit of each task for each robot before the start, ms, for the assignment of tasks. A row
    /// per robot by rank and a column per task; `None` without a behavior for the task.
    pub planned_cost_ms: fn(&Setup) -> Vec<Vec<Option<i64>>>,
}

impl ControllerKind {
    /// Registers the controllers of a mission. All planned costs are equal.
    #[must_use]
    pub const fn new(data: Mission, constructor: fn(&Setup) -> ControllerConstructor) -> Self {
        Self {
            data,
            constructor,
            planned_cost_ms: equal_costs_ms,
        }
    }
}

fn equal_costs_ms(setup: &Setup) -> Vec<Vec<Option<i64>>> {
    let catalog = &setup.catalog;
    let robots = setup.scenario.robots.iter();
    let row = robots.map(|robot| {
        let mut row = vec![None; catalog.tasks.len()];
        for behavior in catalog.behaviors_of(robot) {
            row[catalog.sets[behavior.index()].task.index()] = Some(1000);
        }
        row
    });
    row.collect()
}

/// The inputs of a step beside broadcasts.
#[derive(Clone, Copy, Debug)]
pub struct ControllerInput<'a> {
    /// The time of the step. Strictly increasing.
    pub now: SimTime,
    /// The sensor readings of the robot.
    pub readings: &'a Readings,
    /// The robot's behaviors, in the order of `Catalog::behaviors_of`.
    pub behaviors: &'a [OwnBehavior],
}

impl<'a> ControllerInput<'a> {
    /// Returns the reading of the position sensor, m; `None` while it is dead.
    #[must_use]
    pub fn position(&self) -> Option<Vec2> {
        self.readings.pose.map(|pose| pose.position)
    }

    /// Returns the reading of the mission's devices, in the type that the mission's world writes. It is the default
    /// without a reading.
    #[must_use]
    pub fn reading<R: Reading>(&self) -> Cow<'a, R> {
        self.readings.mission.value()
    }

    /// Returns the task of the active behavior.
    #[must_use]
    pub fn task_of(&self, active: Option<BehaviorId>) -> Option<TaskId> {
        let mut behaviors = self.behaviors.iter();
        let behavior = behaviors.find(|behavior| Some(behavior.id) == active);
        behavior.map(|behavior| behavior.task)
    }
}

/// The result of [`MissionController::perceive`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Perception {
    /// Sensory feedback (eq. 2.1): one value per behavior, in the order of [`ControllerInput::behaviors`].
    pub applicable: Vec<bool>,
    /// The tasks on which the robot had an effect since the last step, one entry per effect.
    pub progressed: Vec<TaskId>,
    /// Notes for events.csv.
    pub notes: Vec<Note>,
}

impl Perception {
    pub(crate) fn clear(&mut self) {
        self.applicable.clear();
        self.progressed.clear();
        self.notes.clear();
    }
}

/// The result of [`MissionController::act`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepOutput {
    /// The command to the body, with the mission's own action. Speeds are finite; the body limits them.
    pub actuation: Actuation,
    /// Broadcasts to send in addition to heartbeats.
    pub bulletins: Vec<Bulletin>,
    /// Notes for events.csv, after those of the perception.
    pub notes: Vec<Note>,
}

impl StepOutput {
    pub(crate) fn clear(&mut self) {
        self.actuation = Actuation::default();
        self.bulletins.clear();
        self.notes.clear();
    }
}
