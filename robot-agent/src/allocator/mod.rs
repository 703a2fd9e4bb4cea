//! The seam between a robot's mind and the rule that chooses its task.
//!
//! A rule is a type that implements [`Allocator`]. In each step it gets an [`Input`], with one [`Choice`] per behavior of the robot,
//! and writes a [`Decision`]: which behavior is active, what to tell the team, and what the log should show of its reasoning.
//! Everything else is done for it: heartbeats, state changes with their reasons, the step that goes back because it did not count.
//!
//! - [`kind`](Kind): an allocator by name, as scenarios state it, with its parameters.
//! - [`registry`](AgentRegistry): the allocators that a program knows.
//! - [`assignment`]: tasks that are given before the start.
//! - `framed`: what is done for an [`Allocator`] around its step.
//! - [`mod@unit`]: the unit of work under way, and what makes a robot choose anew, for rules that do so on a change alone.
//! - [`utility`]: the utility that rules which compare costs have in common.
//!
//! # What an allocator may rely on, and must keep
//! - Inputs are all it knows: no clock, no file, no global, no thread. The same inputs give the same decision on every machine.
//! - Its state is all in the value: a clone is a checkpoint, to which a robot goes back when its step did not count.
//! - What is sent at tick *t* is heard at *t* + 1 or later, doubled, or never. Messages of other allocators are ignored.
//! - The active behavior is one of the choices that are applicable in that step.

pub mod assignment;
mod framed;
mod kind;
mod registry;
#[cfg(test)]
mod tests;
pub mod unit;
pub mod utility;

use std::fmt::Debug;
use std::sync::Arc;

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use alliance_proto::rng::{self, Purpose};
use alliance_proto::scenario::{KnownTimes, ParameterSpec, Setup, TaskSpec};
use alliance_proto::team::{Broadcast, TaskState};
use alliance_proto::telemetry::{AllocationRow, Motivation, Reason, StateChange};
use alliance_proto::tick::Offer;
use alliance_proto::time::SimTime;
use glam::Vec2;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

pub use framed::Framed;
pub(crate) use kind::config;
pub use kind::{ConfigError, Kind, Prepared, Typed};
pub use registry::AgentRegistry;

/// A rule by which one robot chooses its task; pure.
///
/// ```
/// use robot_agent::allocator::{Allocator, Decision, Input, Me, NoParameters};
///
/// /// Goes on with what it has begun, and else takes the first task that it can do.
/// #[derive(Clone, Debug)]
/// struct First;
///
/// impl Allocator for First {
///     type Config = NoParameters;
///
///     fn new(_: &Me, _: &NoParameters) -> Self {
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
/// robot_agent::testkit::allocator::<First>(&NoParameters {});
/// ```
pub trait Allocator: Clone + Debug + Send + 'static {
    /// Its parameters. Where a [`Typed`] reads them, as `[allocators.NAME]` of a scenario states them, every key has a default, and
    /// unknown keys are refused.
    type Config: Send + Sync + 'static;

    /// The keys of its parameters, for people and for checks: unit, default, meaning and range of each.
    #[must_use]
    fn parameters() -> Vec<ParameterSpec> {
        Vec::new()
    }

    /// Whether it goes by the tasks that are given to its robot before the start, [`Me::assigned`]: else nobody works them out.
    #[must_use]
    fn wants_assignment() -> bool {
        false
    }

    /// Whether its robot is told the [truth](Input::truth): else nobody works it out.
    #[must_use]
    fn wants_truth() -> bool {
        false
    }

    /// Whether its robot speaks and listens at all. One that does not sends no heartbeats and nothing of what it knows, and hears
    /// nothing of what others know.
    #[must_use]
    fn uses_radio() -> bool {
        true
    }

    /// A robot at the start of an incarnation: it has heard nothing yet.
    fn new(me: &Me, config: &Self::Config) -> Self;

    /// One step. `decision` is empty when it comes, but for [`Decision::active`], which is what it was after the step before.
    fn step(&mut self, input: &Input<'_>, decision: &mut Decision);
}

/// The parameters of an allocator that has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoParameters {}

/// What a robot knows of itself and its team for the whole run.
#[derive(Clone, Debug, PartialEq)]
pub struct Me {
    /// The robot itself.
    pub robot: RobotId,
    /// Number of its incarnation, from 1; a restart is the next one.
    pub incarnation: Incarnation,
    /// Number of robots of the scenario; their ids are 0 to `team - 1`.
    pub team: usize,
    /// Number of tasks of the scenario.
    pub tasks: usize,
    /// What everybody knows of each task beforehand, by its id; once for all robots of a process.
    pub briefs: Arc<[TaskBrief]>,
    /// Its own behaviors, in the order of [`Input::choices`].
    pub behaviors: Vec<OwnBehavior>,
    /// Length of a step, s.
    pub step_s: f64,
    /// 1/ρ: every robot that uses its radio speaks at least so often, whatever its allocator.
    pub heartbeat_period: SimTime,
    /// τ: a teammate that has been silent for so long has ceased.
    pub ceased_after: SimTime,
    /// The tasks that are given to this robot beforehand; none where no allocator of the team
    /// [wants](Allocator::wants_assignment) it.
    pub assigned: Arc<[TaskId]>,
}

/// What everybody knows of a task beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskBrief {
    /// How many robots may perform it at once.
    pub max_robots: usize,
    /// Higher goes first.
    pub priority: i32,
    /// Longest unit of its work, from one sign of progress to the next, for any robot that can do it, s: an estimate.
    pub unit_s: f64,
    /// The robots that have a behavior for it, by rank.
    pub robots: Vec<RobotId>,
}

impl TaskBrief {
    /// Those of all tasks, by id.
    #[must_use]
    pub fn all(setup: &Setup) -> Arc<[Self]> {
        let (scenario, catalog) = (&setup.scenario, &setup.catalog);
        let of = |spec: &TaskSpec| Self {
            max_robots: spec.max_robots as usize,
            priority: spec.priority,
            unit_s: 0.0,
            robots: Vec::new(),
        };
        let mut all: Vec<Self> = catalog.tasks.iter().map(of).collect();
        for (robot, rank) in scenario.robots.iter().zip(0..) {
            let body = scenario.body_of(robot);
            for id in catalog.behaviors_of(robot) {
                let behavior = &catalog.sets[id.index()];
                let brief = &mut all[behavior.task.index()];
                let skill = robot.skill_at(behavior);
                let unit_s = catalog.mission.unit_s(scenario, &body, skill, behavior);
                brief.unit_s = brief.unit_s.max(unit_s);
                if brief.robots.last() != Some(&RobotId(rank)) {
                    brief.robots.push(RobotId(rank));
                }
            }
        }
        all.into()
    }
}

/// A behavior that a robot has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnBehavior {
    /// Its id.
    pub id: BehaviorId,
    /// The task that it performs.
    pub task: TaskId,
    /// How many robots may perform the task at once.
    pub max_robots: usize,
    /// Of the task; higher goes first.
    pub priority: i32,
}

impl OwnBehavior {
    /// Those of a robot, in the order of [`Catalog::behaviors_of`](alliance_proto::scenario::Catalog::behaviors_of).
    #[must_use]
    pub fn all_of(robot: RobotId, setup: &Setup) -> Vec<Self> {
        let (own, catalog) = (&setup.scenario.robots[robot.index()], &setup.catalog);
        let behaviors = catalog.behaviors_of(own).map(|id| {
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

/// What a robot brings to a step.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// Time of the step; later than that of the step before.
    pub now: SimTime,
    /// Length of a step, s. A step made late is still one step.
    pub step_s: f64,
    /// Where the robot believes to be, m; `None` while its position sensor is dead.
    pub position: Option<Vec2>,
    /// Whether it carries something that its task is about.
    pub is_laden: bool,
    /// Whether each own behavior can be active in this step (sensory feedback, eq. 2.1), in the order of [`Me::behaviors`].
    pub applicable: &'a [bool],
    /// The same with costs, rounds and rewards: one per own behavior; empty for a [`Mind`] that does not weigh them.
    pub choices: &'a [Choice],
    /// Tasks on which the robot itself achieved an effect on the world since its last step, one entry per effect.
    pub progressed: &'a [TaskId],
    /// What it hears in this step, by (rank of the sender, incarnation, sequence number).
    pub heard: &'a [Arc<Broadcast>],
    /// What tasks cost after others, for those who plan sequences.
    pub route: &'a dyn RouteCost,
    /// The offers of the step before, by robot, of all that share tasks with it, directly or through others; from the world itself and
    /// not by radio; empty unless the allocator [asks](Allocator::wants_truth) for them. An offer is a row of [`Decision::rows`] with a utility above 0, of a robot of such an
    /// allocator that can work, on a task that is due in truth.
    pub truth: &'a [Offer],
    /// Random numbers of this step.
    pub draws: Draws,
}

/// What a behavior of the robot has to offer in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The behavior.
    pub behavior: BehaviorId,
    /// The task that it performs.
    pub task: TaskId,
    /// Since when the task has been due again, as far as the robot knows, ms; what was said about an older round is void.
    pub round: SimTime,
    /// Whether the behavior can be active in this step (sensory feedback, eq. 2.1).
    pub applicable: bool,
    /// Estimated time of one unit of its work, s, from what the robot itself knows; `None` if it cannot tell.
    pub cost_s: Option<f64>,
    /// What a unit is worth, in the mission's own measure.
    pub reward: f64,
    /// Of the task; higher goes first.
    pub priority: i32,
    /// How many robots may perform the task at once.
    pub max_robots: usize,
}

/// Cost of a task after others.
pub trait RouteCost {
    /// Estimated time of a unit of `task` for a robot that has just done a unit of each of `after`, s. `None` if it cannot tell.
    fn seconds(&self, after: &[TaskId], task: TaskId) -> Option<f64>;
}

/// What comes of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decision {
    /// The behavior that the robot shall carry out. It must be one of the choices that are applicable.
    pub active: Option<BehaviorId>,
    /// Why that has changed, if it has; `None`: [`Reason::Chosen`], or [`Reason::NotApplicable`] where that is so.
    pub reason: Option<Reason>,
    /// What to tell the team: at most one message more than the robot has tasks.
    pub say: Vec<AllocationMessage>,
    /// What the log shows of the reasoning: a row at most per own behavior (allocation.csv).
    pub rows: Vec<AllocationRow>,
}

/// Random numbers of one step of one robot's allocator: numbered by seed, robot and tick, so that a step that is made twice draws
/// the same, and none shifts another's.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    seed: u64,
    robot: RobotId,
    tick: u64,
}

impl Draws {
    /// Words of a step's block.
    const WORDS: u128 = 1 << 12;

    /// Those of that robot in that tick.
    #[must_use]
    pub fn of(seed: u64, robot: RobotId, tick: u64) -> Self {
        Self { seed, robot, tick }
    }

    /// The stream of this step, from its first number on; at most 4,096 words of it may be used.
    #[must_use]
    pub fn stream(&self) -> ChaCha8Rng {
        let mut stream = rng::robot_stream(self.seed, Purpose::Allocation, self.robot);
        stream.set_word_pos(u128::from(self.tick) * Self::WORDS);
        stream
    }
}

/// The part of a heartbeat that comes from the allocator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Announcement {
    /// What the robot does about the task.
    pub state: TaskState,
    /// Since when.
    pub since: SimTime,
    /// The behavior; `None` when idle.
    pub behavior: Option<BehaviorId>,
    /// Its task; `None` when idle.
    pub task: Option<TaskId>,
    /// Effects that the robot has achieved on the task so far; 0 when idle.
    pub progress: u32,
}

/// Everything that comes of a step, heartbeats and log included.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// The active behavior.
    pub active: Option<BehaviorId>,
    /// Rows of motivations.csv: one per own behavior, of allocators that have motivations.
    pub motivations: Vec<Motivation>,
    /// Rows of allocation.csv, of all others.
    pub rows: Vec<AllocationRow>,
    /// Changes of state, in the order in which they happened.
    pub changes: Vec<StateChange>,
    /// Each becomes one heartbeat of this step, in this order.
    pub announcements: Vec<Announcement>,
    /// What the allocator says beside heartbeats.
    pub say: Vec<AllocationMessage>,
}

/// An allocator at work, whatever its type. [`Framed`] makes one of an [`Allocator`]; ALLIANCE, which has states and heartbeats of its
/// own, is one by itself.
pub trait Mind: Debug + Send {
    /// A checkpoint.
    fn checkpoint(&self) -> Box<dyn Mind>;

    /// Whether it looks at [`Input::choices`]: where nobody does they are not worked out. It says the same at all times.
    fn weighs_costs(&self) -> bool {
        true
    }

    /// See [`Allocator::uses_radio`]. It says the same at all times.
    fn uses_radio(&self) -> bool {
        true
    }

    /// How long robots need for tasks, as far as it has learned, by task and robot: what a later run can begin with, in its
    /// [`Profile`](alliance_proto::scenario::Profile).
    fn learned(&self) -> Vec<(TaskId, RobotId, KnownTimes)> {
        Vec::new()
    }

    /// One step.
    fn step(&mut self, input: &Input<'_>, outcome: &mut Outcome);
}

impl Clone for Box<dyn Mind> {
    fn clone(&self) -> Self {
        self.checkpoint()
    }
}
