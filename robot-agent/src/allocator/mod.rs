//! The interface between a robot's controller and its task allocation algorithm.
//!
//! An algorithm is a type that implements [`Allocator`], and an [`AllocatorKind`] registers it under a name. In each
//! step it receives an [`Input`] with one [`Choice`]
//! per behavior of the robot, and writes a [`Decision`]: the active behavior, messages for the team, and rows for the
//! log. The framework adds heartbeats, state changes with their reasons, and the rollback of steps that did not
//! count.
//!
//! - [`assignment`]: tasks assigned before the start.
//! - `framed`: the work that the framework does around the step of an [`Allocator`].
//! - [`mod@unit`]: the unit of work in progress and the events that make a robot select again, for algorithms that
//!   select only on a change.
//! - [`utility`]: the utility of a task, for all algorithms that compare costs.
//!
//! # Guarantees and obligations
//! - An allocator uses only its inputs: no clock, file, global or thread. Equal inputs give equal decisions on every
//!   machine.
//! - The value contains the entire state. A clone is a checkpoint, which the robot restores if a step did not count.
//! - A message sent at tick *t* arrives at *t* + 1 or later, possibly twice, or never. Messages of other allocators
//!   are ignored.
//! - The active behavior is one of the choices that are applicable in that step.
//! - Utilities in rows are finite. A panic ends the robot's agent.

#![warn(missing_docs)]

pub mod assignment;
mod framed;
mod kind;
mod parameter_list;
#[cfg(test)]
mod tests;
pub mod unit;
pub mod utility;

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use glam::Vec2;
use proto::allocation::AllocationMessage;
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, Heartbeat, TaskState};
use proto::telemetry::{AllocationRow, Motivation, Reason, StateChange};
use proto::tick::TaskOffer;
use rand_chacha::ChaCha8Rng;
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use scenario::rng::{self, Purpose};
use scenario::time::SimTime;
use scenario::{Body, LearnedTimes, ParameterSpec, Setup, TaskSpec};
use serde::Deserialize;

pub(crate) use framed::AllocatorRunner;
pub use kind::{AllocatorKind, ConfigError};
pub(crate) use kind::{ConfiguredAllocator, read_config};
pub(crate) use parameter_list::parameters;

/// A task allocation algorithm for one robot; a pure function of its inputs.
///
/// ```
/// use robot_agent::allocator::{Allocator, Decision, Input, NoParameters, SelfState};
///
/// /// Keeps the active behavior while it is applicable, and else takes the first applicable one.
/// #[derive(Clone, Debug)]
/// struct First;
///
/// impl Allocator for First {
///     type Config = NoParameters;
///
///     fn new(_: &SelfState, _: &NoParameters) -> Self {
///         Self
///     }
///
///     fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
///         let mut can = input.choices.iter().filter(|choice| choice.applicable);
///         if !can.clone().any(|choice| Some(choice.behavior) == decision.active) {
///             decision.active = can.next().map(|choice| choice.behavior);
///         }
///     }
/// }
///
/// robot_agent::testkit::check_allocator::<First>(&NoParameters {});
/// ```
pub trait Allocator: Clone + Debug + Send + 'static {
    /// Parameters of the algorithm. [`AllocatorKind::new`] reads them from `[allocators.NAME]` of a scenario: every key needs a
    /// default, and unknown keys are errors.
    type Config: Send + Sync + 'static;

    /// Returns the parameters with unit, default, meaning and range, for documentation and for the check of scenarios.
    /// The default is none.
    #[must_use]
    fn parameters() -> Vec<ParameterSpec> {
        Vec::new()
    }

    /// Returns whether the algorithm uses [`SelfState::assigned`]. The assignment is computed only if an allocator of the
    /// team uses it. The default is false.
    #[must_use]
    fn uses_assignment() -> bool {
        false
    }

    /// Returns whether the algorithm uses the [ground truth](Input::ground_truth). It is computed only on request. The
    /// default is false.
    #[must_use]
    fn uses_ground_truth() -> bool {
        false
    }

    /// Returns whether the algorithm plans a sequence of several tasks for a robot. The default is false.
    #[must_use]
    fn plans_sequences() -> bool {
        false
    }

    /// Returns whether the robot sends and receives broadcasts. If false, it sends neither heartbeats nor shared
    /// knowledge, and receives none. The default is true.
    #[must_use]
    fn uses_radio() -> bool {
        true
    }

    /// Returns whether the algorithm uses [`Input::choices`]. If false, they are not computed, and the robot can have no
    /// active behavior. The default is true.
    #[must_use]
    fn weighs_costs() -> bool {
        true
    }

    /// Creates the state of a robot at the start of an incarnation, before any message.
    fn new(me: &SelfState, config: &Self::Config) -> Self;

    /// Replaces the parameters in the middle of a run and keeps the state, for a branch of the run. Returns whether it
    /// did: if the state depends on a changed parameter, nothing changes. The default accepts no other parameters.
    fn adopt(&mut self, _config: &Self::Config) -> bool {
        false
    }

    /// Runs one step. `decision` is empty except [`Decision::active`], which contains the choice of the previous
    /// step. A step should not allocate memory while the robot continues its work.
    fn step(&mut self, input: &Input<'_>, decision: &mut Decision);
}

/// The parameters of an allocator without parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoParameters {}

/// Facts about a robot and its team that stay the same for the whole run.
#[derive(Clone, Debug, PartialEq)]
pub struct SelfState {
    /// The id of the robot, which is its rank in the scenario.
    pub robot: RobotId,
    /// Number of the incarnation, from 1. A restart is the next one.
    pub incarnation: Incarnation,
    /// The number of robots in the scenario. Their ids are 0 to `team - 1`.
    pub team: usize,
    /// The number of tasks in the scenario.
    pub tasks: usize,
    /// The data of each task, by its id, shared by all robots of a process.
    pub briefs: Arc<[TaskBrief]>,
    /// The behaviors of this robot, in the order of [`Input::choices`].
    pub behaviors: Vec<OwnBehavior>,
    /// The length of a step, s.
    pub step_s: f64,
    /// 1/ρ, the longest time between two heartbeats of a robot that uses its radio.
    pub heartbeat_period: SimTime,
    /// τ, the time after which a silent teammate counts as failed.
    pub ceased_after: SimTime,
    /// The tasks assigned to this robot before the start. Empty unless an allocator of the team
    /// [uses](Allocator::uses_assignment) the assignment.
    pub assigned: Arc<[TaskId]>,
}

impl SelfState {
    /// Returns the task of a behavior of this robot.
    pub(crate) fn task_of(&self, behavior: BehaviorId) -> Option<TaskId> {
        let mut own = self.behaviors.iter();
        Some(own.find(|own| own.id == behavior)?.task)
    }

    /// Returns the tasks for which the robot has a behavior, in ascending order.
    pub(crate) fn own_tasks(&self) -> Vec<TaskId> {
        let mut tasks: Vec<TaskId> = self.behaviors.iter().map(|own| own.task).collect();
        tasks.sort_unstable();
        tasks.dedup();
        tasks
    }

    /// Returns whether a broadcast of that sender comes from another robot of the team.
    pub(crate) fn is_teammate(&self, sender: RobotId) -> bool {
        sender != self.robot && sender.index() < self.team
    }
}

/// Data of a task that all robots have before the start.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskBrief {
    /// The number of robots that may perform it at once.
    pub max_robots: usize,
    /// The priority; a task of higher priority goes first.
    pub priority: i32,
    /// Estimated duration of the longest unit of work, from one sign of progress to the next, over all robots able to
    /// do it, s.
    pub unit_s: f64,
    /// The robots that have a behavior for the task, by rank.
    pub robots: Vec<RobotId>,
    /// The first task of the group that robots must execute at the same time, if the task belongs to one.
    pub coalition: Option<TaskId>,
}

impl TaskBrief {
    /// Returns the briefs of all tasks, by id.
    #[must_use]
    pub fn all(setup: &Setup) -> Arc<[Self]> {
        let (scenario, catalog) = (&setup.scenario, &setup.catalog);
        let new = |spec: &TaskSpec| Self {
            max_robots: spec.max_robots as usize,
            priority: spec.priority,
            unit_s: 0.0,
            robots: Vec::new(),
            coalition: spec.coalition,
        };
        let mut all: Vec<Self> = catalog.tasks.iter().map(new).collect();
        // Most robots of a team have equal bodies and skills.
        let mut known: Vec<Option<(Body, f64, f64)>> = vec![None; catalog.sets.len()];
        let unit_s_of = catalog.mission.work_unit_s(scenario);
        for (robot, rank) in scenario.robots.iter().zip(0..) {
            let body = scenario.body_of(robot);
            for id in catalog.behaviors_of(robot) {
                let behavior = &catalog.sets[id.index()];
                let brief = &mut all[behavior.task.index()];
                let skill = robot.skill_at(behavior);
                let known = &mut known[id.index()];
                let unit_s = match known {
                    Some((of_body, of_skill, unit_s)) if (*of_body, *of_skill) == (body, skill) => {
                        *unit_s
                    }
                    _ => unit_s_of(&body, skill, behavior),
                };
                *known = Some((body, skill, unit_s));
                brief.unit_s = brief.unit_s.max(unit_s);
                if brief.robots.last() != Some(&RobotId(rank)) {
                    brief.robots.push(RobotId(rank));
                }
            }
        }
        all.into()
    }
}

/// A behavior of a robot, with the data of its task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnBehavior {
    /// The id of the behavior, an index into the run's catalog.
    pub id: BehaviorId,
    /// The task that the behavior performs.
    pub task: TaskId,
    /// The number of robots that may perform the task at once.
    pub max_robots: usize,
    /// The priority of the task; a higher one goes first.
    pub priority: i32,
}

impl OwnBehavior {
    /// Returns the behaviors of a robot, in the order of
    /// [`Catalog::behaviors_of`](scenario::Catalog::behaviors_of).
    #[must_use]
    pub fn of_robot(robot: RobotId, setup: &Setup) -> Vec<Self> {
        let (robot, catalog) = (&setup.scenario.robots[robot.index()], &setup.catalog);
        let behaviors = catalog.behaviors_of(robot).map(|id| {
            let task = catalog.sets[id.index()].task;
            let spec = &catalog.tasks[task.index()];
            Self {
                id,
                task,
                max_robots: spec.max_robots as usize,
                priority: spec.priority,
            }
        });
        behaviors.collect()
    }
}

/// The inputs of one step.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// The time of the step, later than that of the previous step.
    pub now: SimTime,
    /// The length of a step, s. It does not grow if a step is late.
    pub step_s: f64,
    /// The estimated position of the robot, m; `None` while its position sensor is dead.
    pub position: Option<Vec2>,
    /// The measured heading of the robot, rad, counter-clockwise from x; `None` while its position sensor is dead.
    pub heading_rad: Option<f32>,
    /// The remaining energy, J; `None` without a simulation of energy.
    pub energy_j: Option<f32>,
    /// True if the robot carries an object of its task.
    pub is_laden: bool,
    /// Sensory feedback (eq. 2.1) of each behavior: true if it can be active in this step. In the order of
    /// [`SelfState::behaviors`].
    pub applicable: &'a [bool],
    /// A choice per behavior, with cost, round and reward. Empty for ALLIANCE, which does not weigh costs.
    pub choices: &'a [Choice],
    /// The tasks on which the robot had an effect on the world since its last step, one entry per effect.
    pub progressed: &'a [TaskId],
    /// The broadcasts received in this step, sorted by sender, incarnation and sequence number.
    pub received: &'a [Arc<Broadcast>],
    /// Returns the estimated duration of a unit of a task after one unit of each of other tasks, s; `None` without an
    /// estimate. For planners of sequences.
    pub seconds: &'a dyn Fn(&[TaskId], TaskId) -> Option<f64>,
    /// Returns the place to which the robot drives for the next unit of a task, m; `None` without a known place.
    pub place: &'a dyn Fn(TaskId) -> Option<Vec2>,
    /// Returns the estimated travel time to that place, s; `None` without a place or a way.
    pub travel_s: &'a dyn Fn(TaskId) -> Option<f64>,
    /// The offers of the previous step, from the world and not by radio, sorted by robot. Contains all robots that
    /// share tasks with this one, directly or through others. Empty unless the allocator
    /// [requests](Allocator::uses_ground_truth) it. An offer is a row of [`Decision::rows`] with a utility above 0, from a
    /// working robot, for a task that is really due.
    pub ground_truth: &'a [TaskOffer],
    /// The random numbers of this step.
    pub draws: RandomDraws,
}

/// The value of one behavior of the robot in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The id of the behavior, as in [`OwnBehavior::id`].
    pub behavior: BehaviorId,
    /// The task that the behavior performs.
    pub task: TaskId,
    /// The time from which the task is due in the robot's view, ms. Messages about an earlier round are
    /// void.
    pub round: SimTime,
    /// Sensory feedback (eq. 2.1): true if the behavior can be active in this step.
    pub applicable: bool,
    /// The estimated duration of one unit of work, s, finite, from the robot's own knowledge; `None` without an
    /// estimate.
    pub cost_s: Option<f64>,
    /// The time until the work of the unit can begin, s, 0 or more. A robot may drive there before, and waits. The
    /// [cost](Self::cost_s) contains the wait.
    pub opens_in_s: f64,
    /// The reward of one unit, finite, in a measure of the mission.
    pub reward: f64,
    /// The priority of the task; a higher one goes first.
    pub priority: i32,
    /// The number of robots that may perform the task at once.
    pub max_robots: usize,
}

/// The result of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decision {
    /// The behavior to execute. It must be applicable.
    pub active: Option<BehaviorId>,
    /// The reason for a change of [`Decision::active`]. `None` stands for [`Reason::Chosen`], or
    /// [`Reason::NotApplicable`] where it fits.
    pub reason: Option<Reason>,
    /// Messages for the team, at most one more than the robot has tasks.
    pub say: Vec<AllocationMessage>,
    /// Rows for the log (allocation.csv), at most one per behavior of the robot.
    pub rows: Vec<AllocationRow>,
}

/// The random numbers of one step of one robot's allocator. They depend only on seed, robot and tick: a repeated step
/// draws the same numbers, and no robot affects another.
#[derive(Clone, Copy, Debug)]
pub struct RandomDraws {
    seed: u64,
    robot: RobotId,
    tick: u64,
}

impl RandomDraws {
    /// The length of the block of one step, in words of the stream.
    const WORDS: u128 = 1 << 12;

    /// Returns the random numbers of that robot in that tick.
    #[must_use]
    pub fn new(seed: u64, robot: RobotId, tick: u64) -> Self {
        Self { seed, robot, tick }
    }

    /// Returns the random stream of this step. A step may use at most 4,096 words of it.
    #[must_use]
    pub fn stream(&self) -> ChaCha8Rng {
        let mut stream = rng::robot_stream(self.seed, Purpose::Allocation, self.robot);
        stream.set_word_pos(u128::from(self.tick) * Self::WORDS);
        stream
    }
}

/// The content of a heartbeat that the allocator supplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Announcement {
    /// The state of the robot's work on the task.
    pub state: TaskState,
    /// The start time of that state.
    pub since: SimTime,
    /// The behavior; `None` for an idle robot.
    pub behavior: Option<BehaviorId>,
    /// The task; `None` for an idle robot.
    pub task: Option<TaskId>,
    /// The effects on the task so far; 0 for an idle robot.
    pub progress: u32,
}

impl Announcement {
    /// Returns the announcement of a robot without a task.
    pub(crate) fn idle(since: SimTime) -> Self {
        Self {
            state: TaskState::Idle,
            since,
            behavior: None,
            task: None,
            progress: 0,
        }
    }

    /// Returns the heartbeat of a robot at `position`, m, that carries an object or not.
    pub(crate) fn heartbeat(
        &self,
        position: Option<Vec2>,
        carrying: bool,
        shared_knowledge: SharedKnowledge,
    ) -> Heartbeat {
        Heartbeat {
            state: self.state,
            since: self.since,
            set: self.behavior,
            task: self.task,
            progress: self.progress,
            position,
            carrying,
            shared_knowledge,
        }
    }
}

/// The complete result of a step, with heartbeats and log rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepOutcome {
    /// The behavior to execute; `None` for an idle robot.
    pub active: Option<BehaviorId>,
    /// Rows of motivations.csv, one per behavior, from allocators that have motivations.
    pub motivations: Vec<Motivation>,
    /// Rows of allocation.csv, from all other allocators.
    pub rows: Vec<AllocationRow>,
    /// State changes, in the order of their occurrence.
    pub changes: Vec<StateChange>,
    /// The heartbeats of this step, one per entry, in this order.
    pub announcements: Vec<Announcement>,
    /// Messages of the allocator beside heartbeats.
    pub say: Vec<AllocationMessage>,
}

/// The parameters of an allocator of any type.
pub(crate) type AnyConfig = dyn Any + Send + Sync;

/// A running allocator of any type. [`AllocatorRunner`] creates it from an [`Allocator`]. ALLIANCE implements it directly,
/// because it has its own states and heartbeats.
pub(crate) trait RunningAllocator: Debug + Send {
    /// Returns a copy of the state.
    fn checkpoint(&self) -> Box<dyn RunningAllocator>;

    /// Requests the memory of the allocator's lists, see [`prefetch`](mod@prefetch).
    fn prefetch(&self) {}

    /// Returns whether the allocator uses [`Input::choices`]. They are computed only if it does. The result must not
    /// change.
    fn weighs_costs(&self) -> bool {
        true
    }

    /// Returns whether the robot sends and receives broadcasts, see [`Allocator::uses_radio`]. The result must not
    /// change.
    fn uses_radio(&self) -> bool {
        true
    }

    /// Returns the learned durations, by task and robot. A later run can start with them, in its
    /// [`Profile`](scenario::Profile).
    fn learned(&self) -> Vec<(TaskId, RobotId, LearnedTimes)> {
        Vec::new()
    }

    /// Replaces the parameters by those of `setup`, or by `config` if they are in a section of their own, and keeps the
    /// state. Returns whether it did; see [`Allocator::adopt`].
    fn adopt(&mut self, _setup: &Setup, _config: Option<&AnyConfig>) -> bool {
        false
    }

    /// Runs one step and writes its result to `outcome`.
    fn step(&mut self, input: &Input<'_>, outcome: &mut StepOutcome);
}

impl Clone for Box<dyn RunningAllocator> {
    fn clone(&self) -> Self {
        self.checkpoint()
    }
}
