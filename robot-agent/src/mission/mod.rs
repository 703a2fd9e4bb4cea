//! The interface between a robot's controller and its mission: the part of a mission on one robot.
//!
//! An [`AgentMission`] derives the applicable behaviors from readings and received broadcasts, and executes the
//! behavior that the allocator selected. The framework adds links, heartbeats, the allocator, and the rollback of
//! steps that did not count. A [`MissionController`] creates the robot's part under the mission's name, and an
//! `AgentRegistry` contains those of a program. A mission with its own message
//! types is shorter as a [`TypedController`], wrapped in [`ControllerAdapter`].
//!
//! # Guarantees and obligations
//! - A step calls [`AgentMission::perceive`], then [`AgentMission::choices`] if the allocator weighs costs, then
//!   [`AgentMission::act`], all with the same [`ControllerInput`].
//! - A mission uses only its inputs: no clock, file, global or thread. Equal inputs give equal steps on every
//!   machine.
//! - The value contains the entire state. A copy is a checkpoint, which the robot restores if a step did not count.
//! - A message sent at tick *t* arrives at *t* + 1 or later, possibly twice, or never. Shared knowledge and bulletins
//!   of another mission are ignored.

pub mod prelude;
#[cfg(test)]
mod tests;
mod typed;

use std::fmt::Debug;
use std::sync::Arc;

use glam::Vec2;
use proto::mission::SharedKnowledge;
use proto::readings::{Actuation, Readings};
use proto::team::{Broadcast, Bulletin};
use proto::telemetry::Note;
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::mission::registry::Mission;
use scenario::time::SimTime;

use crate::allocator::{Choice, RouteCost};

pub use typed::{ControllerAdapter, ReceivedBroadcast, TypedController, TypedStepInput, bulletin};

/// The robots' part of a mission, independent of a run.
#[derive(Clone, Copy, Debug)]
pub struct MissionController {
    pub data: Mission,
    /// Creates the data that all robots of a run share, once per process. The scenario is valid.
    pub shared: fn(&Setup) -> Arc<dyn SharedMission>,
}

impl MissionController {
    /// Registers a [`TypedController`] whose robots share no data.
    #[must_use]
    pub const fn new<M: TypedController>(data: Mission) -> Self {
        Self {
            data,
            shared: |_| Arc::new(typed::NoSharedData::<M>::new()),
        }
    }
}

/// The data that all robots of a run share.
pub trait SharedMission: Debug + Send + Sync {
    /// Creates the controller of a robot at the start of an incarnation.
    fn create_controller(&self, robot: RobotId, setup: &Setup) -> Box<dyn AgentMission>;

    /// Returns the cost of one unit of each task for each robot before the start, ms, for the assignment. A row per
    /// robot and a column per task; `None` without a behavior for the task. By default all costs are equal.
    fn planned_cost_ms(&self, setup: &Setup) -> Vec<Vec<Option<i64>>> {
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
}

/// The controller of one robot for a mission; a pure function of its inputs. [`TypedController`] is shorter for most
/// missions and contains an example. [`RouteCost`] refers to the state after [`AgentMission::perceive`].
pub trait AgentMission: RouteCost + Debug + Send {
    /// Runs the first part of a step: merges readings and broadcasts into the state. `perception` is empty at the
    /// start.
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    );

    /// Adds one choice per behavior, in the order of `Catalog::behaviors_of`. `applicable` is the result of the
    /// perception.
    fn choices(&self, input: &ControllerInput<'_>, applicable: &[bool], choices: &mut Vec<Choice>);

    /// Runs the last part of a step: computes the action of the active behavior. `output` is empty at the start.
    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    );

    /// Writes the shared knowledge for the heartbeat, after [`AgentMission::act`]. `knowledge` contains an old value whose
    /// memory can be reused.
    fn shared_knowledge(&self, knowledge: &mut SharedKnowledge);

    /// Returns the estimated position of the robot, m; `None` without an estimate.
    fn position(&self) -> Option<Vec2>;

    /// Returns whether the robot carries an object of its task.
    fn is_laden(&self) -> bool;

    /// Returns a copy of the state.
    fn checkpoint(&self) -> Box<dyn AgentMission>;
}

impl Clone for Box<dyn AgentMission> {
    fn clone(&self) -> Self {
        self.checkpoint()
    }
}

/// The inputs of a step beside broadcasts.
#[derive(Clone, Copy, Debug)]
pub struct ControllerInput<'a> {
    /// The time of the step. Strictly increasing.
    pub now: SimTime,
    /// The sensor readings of the robot.
    pub readings: &'a Readings,
}

/// The result of [`AgentMission::perceive`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Perception {
    /// Sensory feedback (eq. 2.1) of each behavior, in the order of `Catalog::behaviors_of`.
    pub applicable: Vec<bool>,
    /// The tasks on which the robot had an effect since the last step, one entry per effect.
    pub progressed: Vec<TaskId>,
    /// Notes for the log.
    pub notes: Vec<Note>,
}

impl Perception {
    pub(crate) fn clear(&mut self) {
        self.applicable.clear();
        self.progressed.clear();
        self.notes.clear();
    }
}

/// The result of [`AgentMission::act`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepOutput {
    /// The command to the body.
    pub actuation: Actuation,
    /// Broadcasts to send in addition to heartbeats.
    pub bulletins: Vec<Bulletin>,
    /// Notes for the log.
    pub notes: Vec<Note>,
}

impl StepOutput {
    pub(crate) fn clear(&mut self) {
        self.actuation = Actuation::default();
        self.bulletins.clear();
        self.notes.clear();
    }
}
