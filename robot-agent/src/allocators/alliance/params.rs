//! The values in force for one robot, by rank instead of by name and in simulated time instead of seconds.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::scenario::{BehaviorParams, Roster, Setup, Switches};
use alliance_proto::team::{Broadcast, Content};
use alliance_proto::time::SimTime;
use smallvec::SmallVec;

use crate::allocator::Me;

/// Everything of a robot's ALLIANCE that does not change during a run.
#[derive(Clone, Debug)]
pub(super) struct Config {
    /// The robot itself.
    pub robot: RobotId,
    /// Number of robots, and of tasks, in the scenario.
    pub team: usize,
    pub task_count: usize,
    /// θ.
    pub threshold: f64,
    /// Length of a step, s.
    pub step_s: f64,
    /// Answers to what the formulas leave open.
    pub switches: Switches,
    /// Number of tasks that the robot has sets for.
    pub own_tasks: usize,
    /// The own sets, in the catalog's order.
    pub sets: SmallVec<[OwnBehavior; USUAL_BEHAVIORS]>,
    /// Time between two idle heartbeats.
    pub idle_period: SimTime,
}

/// Number of behaviors that a robot keeps inline, without a heap allocation: in a large team each step would be a cache miss.
pub(super) const USUAL_BEHAVIORS: usize = 6;

/// One own behavior set.
#[derive(Clone, Debug)]
pub(super) struct OwnBehavior {
    pub id: BehaviorId,
    /// The task that the set performs.
    pub task: TaskId,
    /// Its place among the robot's own tasks.
    pub own_task: usize,
    /// How many robots may execute it at once.
    pub max_robots: usize,
    /// Of the task; higher goes first.
    pub priority: i32,
    pub params: Arc<Params>,
}

/// Parameters of a behavior set (ALLIANCE.md §1).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Params {
    /// 1/ρ.
    pub period: SimTime,
    /// τ.
    pub tau: SimTime,
    /// δ_fast, motivation/s.
    pub fast: f64,
    /// δ_slow and φ toward most teammates.
    pub toward_most: Option<Toward>,
    /// Toward those for whom they are other ones, by rank.
    pub toward: Vec<(RobotId, Toward)>,
    /// ψ.
    pub psi: SimTime,
    /// λ.
    pub lambda: SimTime,
}

/// How one teammate's messages slow a set down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Toward {
    /// δ_slow, motivation/s.
    pub slow: f64,
    /// φ.
    pub phi: SimTime,
}

/// The parameters of a run. Equal ones are there once: most robots of a team have the same.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// By robot and behavior.
    named: BTreeMap<String, BTreeMap<String, Arc<Params>>>,
}

impl Parameters {
    /// Those of all robots of a resolved setup.
    #[must_use]
    pub fn of(setup: &Setup) -> Self {
        // By how they read.
        let mut distinct: BTreeMap<String, Arc<Params>> = BTreeMap::new();
        let mut shared = |values| {
            let params = Params::new(values, &setup.roster);
            let known = distinct.entry(format!("{params:?}"));
            Arc::clone(known.or_insert_with(|| Arc::new(params)))
        };
        let robots = setup.alliance.robots.iter();
        let named = robots.map(|(robot, own)| {
            let behaviors = own.sets.iter();
            let behaviors = behaviors.map(|(name, values)| (name.clone(), shared(values)));
            (robot.clone(), behaviors.collect())
        });
        Self {
            named: named.collect(),
        }
    }
}

impl Config {
    /// Those of a robot whose values will be learned: until then it is impatient with nobody and for nothing.
    pub fn to_be_learned(me: &Me, threshold: f64, switches: Switches) -> Self {
        let tasks: BTreeSet<TaskId> = me.behaviors.iter().map(|own| own.task).collect();
        let params = Arc::new(Params {
            period: me.heartbeat_period,
            tau: me.ceased_after,
            fast: 0.0,
            toward_most: None,
            toward: Vec::new(),
            psi: SimTime::ZERO,
            lambda: SimTime::ZERO,
        });
        let sets = me.behaviors.iter().map(|own| OwnBehavior {
            id: own.id,
            task: own.task,
            // The tasks lower than it: they are all in the set.
            own_task: tasks.range(..own.task).count(),
            max_robots: own.max_robots,
            priority: own.priority,
            params: Arc::clone(&params),
        });
        Self {
            robot: me.robot,
            team: me.team,
            task_count: me.tasks,
            threshold,
            step_s: me.step_s,
            switches,
            idle_period: me.heartbeat_period,
            own_tasks: tasks.len(),
            sets: sets.collect(),
        }
    }

    /// The values of that robot.
    ///
    /// # Panics
    /// If `parameters` are of another setup: a resolved one has those of every robot and behavior.
    pub fn new(robot: RobotId, setup: &Setup, parameters: &Parameters) -> Self {
        let own = &setup.scenario.robots[robot.index()];
        let catalog = &setup.catalog;
        let named = &parameters.named[&own.name];
        let specs = || {
            let ids = catalog.behaviors_of(own);
            ids.map(|id| (id, &catalog.sets[id.index()]))
        };
        let tasks: BTreeSet<TaskId> = specs().map(|(_, spec)| spec.task).collect();
        let sets = specs().map(|(id, spec)| {
            let own_task = tasks.iter().position(|task| *task == spec.task);
            let task = &catalog.tasks[spec.task.index()];
            OwnBehavior {
                id,
                task: spec.task,
                // It was collected from these.
                own_task: own_task.expect("the tasks of all sets are known"),
                max_robots: task.max_robots as usize,
                priority: task.priority,
                params: Arc::clone(&named[&spec.name]),
            }
        });
        let sets: SmallVec<[OwnBehavior; USUAL_BEHAVIORS]> = sets.collect();
        let periods = sets.iter().map(|set| set.params.period);
        Self {
            robot,
            team: setup.scenario.robots.len(),
            task_count: catalog.tasks.len(),
            threshold: setup.alliance.threshold,
            step_s: SimTime(setup.alliance.step_ms).as_secs_f64(),
            switches: setup.alliance.switches,
            idle_period: periods.max().unwrap_or_default(),
            own_tasks: tasks.len(),
            sets,
        }
    }

    /// Whether a broadcast comes from a teammate and names a task of this mission, if any.
    pub fn admits(&self, broadcast: &Broadcast) -> bool {
        let task = match &broadcast.body {
            Content::Heartbeat(heartbeat) => heartbeat.task,
            Content::Bulletin(bulletin) => bulletin.about.map(|about| about.task),
            Content::Allocation(_) => None,
        };
        broadcast.sender != self.robot
            && broadcast.sender.index() < self.team
            && task.is_none_or(|task| task.index() < self.task_count)
    }

    /// The place of a task among those of the robot's own sets.
    pub fn own_task(&self, task: TaskId) -> Option<usize> {
        // They are few, and near.
        let set = self.sets.iter().find(|set| set.task == task);
        set.map(|set| set.own_task)
    }
}

impl Params {
    fn new(values: &BehaviorParams, roster: &Roster) -> Self {
        let toward = |name: &str| Toward {
            slow: values.slow_toward(name),
            phi: SimTime::from_secs_f64(values.phi_toward(name)),
        };
        let listed = values.slow_impatience.keys();
        let listed = listed.filter_map(|name| Some((roster.robot_named(name)?, toward(name))));
        let mut listed: Vec<(RobotId, Toward)> = listed.collect();
        listed.sort_unstable_by_key(|&(robot, _)| robot);
        let toward_most = match listed.first() {
            // A large team has one value for all that it does not list; others list all, mostly with the same values.
            _ if values.slow_impatience.contains_key(BehaviorParams::OTHERS) => {
                Some(toward(BehaviorParams::OTHERS))
            }
            first => first.map(|&(_, toward)| toward),
        };
        listed.retain(|&(_, toward)| Some(toward) != toward_most);
        Self {
            period: SimTime::from_secs_f64(1.0 / values.broadcast_rate_hz),
            tau: SimTime::from_secs_f64(values.ceased_after_s),
            fast: values.fast_impatience,
            toward_most,
            toward: listed,
            psi: SimTime::from_secs_f64(values.before_yielding_s),
            lambda: SimTime::from_secs_f64(values.before_giving_up_s),
        }
    }

    /// δ_slow and φ toward a teammate.
    pub fn toward(&self, teammate: RobotId) -> Option<Toward> {
        let listed = self
            .toward
            .binary_search_by_key(&teammate, |&(robot, _)| robot);
        match listed {
            Ok(place) => Some(self.toward[place].1),
            Err(_) => self.toward_most,
        }
    }

    /// How long the set waits at most: ψ + τ (ALLIANCE.md §3 "Waiting ends").
    pub fn waiting_bound(&self) -> SimTime {
        self.psi + self.tau
    }
}
