//! How a team shares its tasks: two robots on one exclusive task, and idle robots beside a task that nobody executes.

use std::collections::BTreeMap;

use proto::telemetry::{BehaviorState, Motivation};
use scenario::Scenario;
use scenario::ids::TaskId;
use scenario::time::SimTime;
use world_server::simulation::Simulation;

use super::violation::ViolationKind;
use crate::invariants::WorldState;
use crate::invariants::coverage::{is_covered, is_operational};
use crate::invariants::reception::hear_each_other;

/// The times of the conditions that have held without a break until the last look.
#[derive(Clone, Debug, Default)]
pub struct Cooperation {
    /// By two robots, by rank, and the exclusive task that both execute: since when.
    duplicated: BTreeMap<(usize, usize, TaskId), SimTime>,
    /// By an idle robot, by rank: since when a task applicable to it has had no executor.
    idle: BTreeMap<usize, SimTime>,
}

/// A condition that has held until now.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    pub kind: ViolationKind,
    pub held: SimTime,
    /// The robots and the task.
    pub description: String,
}

impl Cooperation {
    /// Looks at the state after a tick. Returns the conditions that hold, each with its time so far.
    ///
    /// Robots count only while their bodies follow their controllers. While a robot sends false information or cannot
    /// put down an item, all times start again.
    pub fn look(
        &mut self,
        scenario: &Scenario,
        simulation: &Simulation,
        state: &WorldState,
    ) -> Vec<Held> {
        let team = Team::new(scenario, simulation, state);
        let before = std::mem::take(self);
        if !is_covered(scenario, state) {
            return Vec::new();
        }
        let mut found = Vec::new();
        for (place, &(one, task)) in team.executed.iter().enumerate() {
            for &(other, same) in &team.executed[..place] {
                let is_exclusive = simulation.catalog().tasks[task.index()].max_robots == 1;
                if task == same && is_exclusive && hear_each_other(scenario, state, one, other) {
                    let key = (other, one, task);
                    let since = *before.duplicated.get(&key).unwrap_or(&state.now);
                    self.duplicated.insert(key, since);
                    found.push(Held {
                        kind: ViolationKind::Duplicated,
                        held: state.now.since(since),
                        description: format!(
                            "{} and {} receive each other's messages and both execute {}",
                            team.name(other),
                            team.name(one),
                            simulation.catalog().task_name(task),
                        ),
                    });
                }
            }
        }
        for (rank, task) in team.unserved() {
            let since = *before.idle.get(&rank).unwrap_or(&state.now);
            self.idle.insert(rank, since);
            found.push(Held {
                kind: ViolationKind::Idle,
                held: state.now.since(since),
                description: format!(
                    "{} executes no task, and no robot executes {}, which is applicable to it",
                    team.name(rank),
                    simulation.catalog().task_name(task),
                ),
            });
        }
        found
    }
}

/// The operational robots and their tasks.
struct Team<'a> {
    scenario: &'a Scenario,
    /// The executed tasks, by rank.
    executed: Vec<(usize, TaskId)>,
    /// The tasks applicable to each robot that executes none, by rank.
    applicable: Vec<(usize, Vec<TaskId>)>,
}

impl<'a> Team<'a> {
    fn new(scenario: &'a Scenario, simulation: &Simulation, state: &WorldState) -> Self {
        let task = |level: &Motivation| simulation.catalog().sets[level.set.index()].task;
        let (mut executed, mut applicable) = (Vec::new(), Vec::new());
        for robot in simulation.barrier().robots() {
            let rank = robot.index();
            if !is_operational(scenario, state, rank) {
                continue;
            }
            let levels = simulation.levels(robot);
            let active = levels
                .iter()
                .find(|level| level.state == BehaviorState::Active);
            if let Some(level) = active {
                executed.push((rank, task(level)));
            } else {
                let open = levels.iter().filter(|level| level.sensory_feedback);
                applicable.push((rank, open.map(task).collect()));
            }
        }
        Self {
            scenario,
            executed,
            applicable,
        }
    }

    /// Returns each idle robot beside a task applicable to it that no robot executes.
    fn unserved(&self) -> impl Iterator<Item = (usize, TaskId)> {
        let is_executed = |task: &TaskId| self.executed.iter().any(|(_, other)| other == task);
        self.applicable.iter().filter_map(move |(rank, tasks)| {
            let mut tasks = tasks.iter().filter(|task| !is_executed(task));
            Some((*rank, *tasks.next()?))
        })
    }

    fn name(&self, rank: usize) -> &'a str {
        &self.scenario.robots[rank].name
    }
}
