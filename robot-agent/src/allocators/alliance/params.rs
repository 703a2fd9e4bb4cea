//! The parameters in force for one robot, indexed by rank and in simulated time.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use proto::team::{Broadcast, BroadcastContent};
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{BehaviorParams, Roster, Setup, Switches};
use smallvec::SmallVec;

use crate::allocator::SelfState;

/// The part of a robot's ALLIANCE state that is constant during a run.
#[derive(Clone, Debug)]
pub(super) struct Config {
    pub robot: RobotId,
    pub team: usize,
    pub task_count: usize,
    pub threshold: f64,
    pub step_s: f64,
    pub switches: Switches,
    pub task_count_of_robot: usize,
    /// The robot's behavior sets, in the catalog's order.
    pub sets: SmallVec<[SetConfig; USUAL_BEHAVIORS]>,
    pub idle_period: SimTime,
}

/// The number of behaviors stored inline, without a heap allocation.
pub(super) const USUAL_BEHAVIORS: usize = 6;

#[derive(Clone, Debug)]
pub(super) struct SetConfig {
    pub id: BehaviorId,
    pub task: TaskId,
    pub task_index: usize,
    pub max_robots: usize,
    /// The task's priority; higher goes first.
    pub priority: i32,
    pub params: Arc<Params>,
}

/// The parameters of a behavior set (docs/ALLIANCE.md §1).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Params {
    /// 1/ρ, the time between two heartbeats.
    pub period: SimTime,
    /// τ, the silence after which a teammate counts as lost.
    pub tau: SimTime,
    /// δ_fast, in motivation/s.
    pub fast: f64,
    /// δ_slow and φ toward teammates not listed in `toward`.
    pub toward_most: Option<TowardTeammate>,
    /// δ_slow and φ that differ from `toward_most`, by rank.
    pub toward: Vec<(RobotId, TowardTeammate)>,
    /// The time active before yielding (ψ).
    pub psi: SimTime,
    /// The time active before giving up (λ).
    pub lambda: SimTime,
}

/// The effect of one teammate's messages on the impatience of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TowardTeammate {
    /// δ_slow, in motivation/s.
    pub slow: f64,
    /// φ, the longest time for which the messages slow the set down.
    pub phi: SimTime,
}

/// The parameters of all robots of a run; equal values are stored once.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// The values by robot name and behavior set name.
    named: BTreeMap<String, BTreeMap<String, Arc<Params>>>,
}

impl Parameters {
    #[must_use]
    pub fn from_setup(setup: &Setup) -> Self {
        // The key is the debug text of the values.
        let mut distinct: BTreeMap<String, Arc<Params>> = BTreeMap::new();
        let mut shared = |values| {
            let params = Params::new(values, &setup.roster);
            let entry = distinct.entry(format!("{params:?}"));
            Arc::clone(entry.or_insert_with(|| Arc::new(params)))
        };
        let robots = setup.alliance.robots.iter();
        let named = robots.map(|(robot, params)| {
            let behaviors = params.sets.iter();
            let behaviors = behaviors.map(|(name, values)| (name.clone(), shared(values)));
            (robot.clone(), behaviors.collect())
        });
        Self {
            named: named.collect(),
        }
    }
}

impl Config {
    /// Creates the configuration of a robot whose values are learned later. Until then its impatience is 0.
    pub fn to_be_learned(me: &SelfState, threshold: f64, switches: Switches) -> Self {
        let tasks: BTreeSet<TaskId> = me.behaviors.iter().map(|behavior| behavior.task).collect();
        let params = Arc::new(Params {
            period: me.heartbeat_period,
            tau: me.ceased_after,
            fast: 0.0,
            toward_most: None,
            toward: Vec::new(),
            psi: SimTime::ZERO,
            lambda: SimTime::ZERO,
        });
        let sets = me.behaviors.iter().map(|behavior| SetConfig {
            id: behavior.id,
            task: behavior.task,
            // The task is in the set, so the number of lower tasks is its index.
            task_index: tasks.range(..behavior.task).count(),
            max_robots: behavior.max_robots,
            priority: behavior.priority,
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
            task_count_of_robot: tasks.len(),
            sets: sets.collect(),
        }
    }

    /// Creates the configuration of `robot` from its scenario values.
    ///
    /// # Panics
    /// Panics if `parameters` come from another setup. Those of a resolved setup contain every robot and behavior.
    pub fn new(robot: RobotId, setup: &Setup, parameters: &Parameters) -> Self {
        let spec = &setup.scenario.robots[robot.index()];
        let catalog = &setup.catalog;
        let named = &parameters.named[&spec.name];
        let specs = || {
            let ids = catalog.behaviors_of(spec);
            ids.map(|id| (id, &catalog.sets[id.index()]))
        };
        let tasks: BTreeSet<TaskId> = specs().map(|(_, spec)| spec.task).collect();
        let sets = specs().map(|(id, spec)| {
            let own_task = tasks.iter().position(|task| *task == spec.task);
            let task = &catalog.tasks[spec.task.index()];
            SetConfig {
                id,
                task: spec.task,
                // The tasks were collected from the same sets.
                task_index: own_task.expect("the tasks were collected from these sets"),
                max_robots: task.max_robots as usize,
                priority: task.priority,
                params: Arc::clone(&named[&spec.name]),
            }
        });
        let sets: SmallVec<[SetConfig; USUAL_BEHAVIORS]> = sets.collect();
        let periods = sets.iter().map(|set| set.params.period);
        Self {
            robot,
            team: setup.scenario.robots.len(),
            task_count: catalog.tasks.len(),
            threshold: setup.alliance.threshold,
            step_s: SimTime(setup.alliance.step_ms).as_secs_f64(),
            switches: setup.alliance.switches,
            idle_period: periods.max().unwrap_or_default(),
            task_count_of_robot: tasks.len(),
            sets,
        }
    }

    /// Checks that a broadcast comes from a teammate and that any task it names exists in this mission.
    pub fn accepts(&self, broadcast: &Broadcast) -> bool {
        let task = match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => heartbeat.task,
            BroadcastContent::Bulletin(bulletin) => bulletin.about.map(|about| about.task),
            BroadcastContent::Allocation(_) => None,
        };
        broadcast.sender != self.robot
            && broadcast.sender.index() < self.team
            && task.is_none_or(|task| task.index() < self.task_count)
    }

    /// Returns the index of a task among the robot's tasks.
    pub fn own_task(&self, task: TaskId) -> Option<usize> {
        // The list is short and inline, so that a linear search is fast.
        let set = self.sets.iter().find(|set| set.task == task);
        set.map(|set| set.task_index)
    }
}

impl Params {
    fn new(values: &BehaviorParams, roster: &Roster) -> Self {
        let toward = |name: &str| TowardTeammate {
            slow: values.slow_impatience_toward(name),
            phi: SimTime::from_secs_f64(values.willing_to_affect_toward_s(name)),
        };
        let listed = values.slow_impatience.keys();
        let listed = listed.filter_map(|name| Some((roster.find(name)?, toward(name))));
        let mut listed: Vec<(RobotId, TowardTeammate)> = listed.collect();
        listed.sort_unstable_by_key(|&(robot, _)| robot);
        let toward_most = match listed.first() {
            // A large team has one value for all unlisted teammates. Other teams list each one, mostly with equal
            // values.
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

    pub fn toward(&self, teammate: RobotId) -> Option<TowardTeammate> {
        let listed = self
            .toward
            .binary_search_by_key(&teammate, |&(robot, _)| robot);
        match listed {
            Ok(place) => Some(self.toward[place].1),
            Err(_) => self.toward_most,
        }
    }

    /// Returns the longest total wait of the set, ψ + τ (docs/ALLIANCE.md §3 "Waiting ends").
    pub fn waiting_bound(&self) -> SimTime {
        self.psi + self.tau
    }
}
