//! The values in force for one robot, by rank instead of by name and in simulated time instead of seconds.

use std::collections::BTreeMap;

use alliance_proto::ids::{RobotId, SetId, TaskId};
use alliance_proto::scenario::{Catalog, SetParams, Setup, Switches};
use alliance_proto::team::{Body, Broadcast};
use alliance_proto::time::SimTime;

/// Everything of a robot's ALLIANCE that does not change during a run.
#[derive(Debug)]
pub(super) struct Config {
    /// The robot itself.
    pub robot: RobotId,
    /// Number of robots in the scenario.
    pub team: usize,
    /// θ.
    pub threshold: f64,
    /// Length of a step, s.
    pub step_s: f64,
    /// Answers to what the formulas leave open.
    pub switches: Switches,
    /// By task id.
    pub tasks: Vec<Task>,
    /// Ids of the robot's own sets, in the catalog's order.
    pub set_ids: Vec<SetId>,
    /// Parameters of the own sets, in the same order.
    pub sets: Vec<Params>,
    /// Time between two idle heartbeats.
    pub idle_period: SimTime,
}

/// What the selection needs to know of a task.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task {
    /// How many robots may execute it at once.
    pub max_robots: usize,
    /// Higher goes first.
    pub priority: i32,
}

/// Parameters of one own behavior set (ALLIANCE.md §1).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Params {
    /// The task that the set performs.
    pub task: TaskId,
    /// 1/ρ.
    pub period: SimTime,
    /// τ.
    pub tau: SimTime,
    /// δ_fast, motivation/s.
    pub fast: f64,
    /// δ_slow and φ by teammate.
    pub toward: BTreeMap<RobotId, Toward>,
    /// ψ.
    pub psi: SimTime,
    /// λ.
    pub lambda: SimTime,
}

/// How one teammate's messages slow a set down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Toward {
    /// δ_slow, motivation/s.
    pub slow: f64,
    /// φ.
    pub phi: SimTime,
}

impl Config {
    /// The values of that robot.
    ///
    /// # Panics
    /// If `setup.alliance` lacks a value for one of the robot's sets or teammates: resolving a scenario fills in all.
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        let robots = &setup.scenario.robots;
        let catalog = Catalog::of(&setup.scenario);
        let own = &robots[robot.index()];
        let set_ids: Vec<SetId> = catalog.sets_of(own).collect();
        let named = &setup.alliance.robots[&own.name].sets;
        let sets: Vec<Params> = set_ids
            .iter()
            .map(|id| {
                let spec = &catalog.sets[id.index()];
                let teammates = (0..)
                    .map(RobotId)
                    .zip(robots)
                    .filter(|&(rank, _)| rank != robot)
                    .map(|(rank, teammate)| (rank, teammate.name.as_str()));
                Params::new(spec.task, &named[&spec.name], teammates)
            })
            .collect();
        Self {
            robot,
            team: robots.len(),
            threshold: setup.alliance.threshold,
            step_s: SimTime(setup.alliance.step_ms).as_secs_f64(),
            switches: setup.alliance.switches,
            tasks: catalog
                .tasks
                .iter()
                .map(|task| Task {
                    max_robots: task.max_robots as usize,
                    priority: task.priority,
                })
                .collect(),
            set_ids,
            idle_period: sets.iter().map(|set| set.period).max().unwrap_or_default(),
            sets,
        }
    }

    /// Whether a broadcast comes from a teammate and names a task of this mission, if any.
    pub fn admits(&self, broadcast: &Broadcast) -> bool {
        let task = match &broadcast.body {
            Body::Heartbeat(heartbeat) => heartbeat.task,
            Body::PositionUpdate { task, .. } => Some(*task),
            Body::Withdrawal(_) => None,
        };
        broadcast.sender != self.robot
            && broadcast.sender.index() < self.team
            && task.is_none_or(|task| task.index() < self.tasks.len())
    }

    /// The task of the own set at `index`.
    pub fn task_of(&self, index: usize) -> Task {
        self.tasks[self.sets[index].task.index()]
    }
}

impl Params {
    fn new<'a>(
        task: TaskId,
        values: &SetParams,
        teammates: impl Iterator<Item = (RobotId, &'a str)>,
    ) -> Self {
        let toward = |name: &str| Toward {
            slow: values.slow_impatience[name],
            phi: SimTime::from_secs_f64(values.willing_to_affect_s[name]),
        };
        Self {
            task,
            period: SimTime::from_secs_f64(1.0 / values.broadcast_rate_hz),
            tau: SimTime::from_secs_f64(values.ceased_after_s),
            fast: values.fast_impatience,
            toward: teammates.map(|(rank, name)| (rank, toward(name))).collect(),
            psi: SimTime::from_secs_f64(values.before_yielding_s),
            lambda: SimTime::from_secs_f64(values.before_giving_up_s),
        }
    }

    /// How long the set waits at most: ψ + τ (ALLIANCE.md §3 "Waiting ends").
    pub fn waiting_bound(&self) -> SimTime {
        self.psi + self.tau
    }
}
