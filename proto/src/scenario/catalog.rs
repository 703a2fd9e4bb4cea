//! The tasks and behavior sets of a mission, with the ids that cross the bus.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Robot, Scenario};
use crate::ids::{BehaviorId, TaskId};
use crate::mission::known::Mission;

/// A task (thesis §3.3.1).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskSpec {
    /// Name, as in the logs.
    pub name: String,
    /// How many robots may execute it at once; 1 is exclusive.
    pub max_robots: u32,
    /// Higher goes first.
    pub priority: i32,
}

/// A behavior set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BehaviorSpec {
    /// Name, as in the logs and parameter files.
    pub name: String,
    /// The task that it performs.
    pub task: TaskId,
    /// What it does: a number of the mission's own.
    pub kind: u32,
    /// The skill that it takes, if any: a robot without it does not have the behavior.
    pub skill: Option<String>,
}

/// All tasks and behavior sets of a scenario; the index of each is its id.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Catalog {
    /// The mission whose they are.
    pub mission: Mission,
    /// Tasks.
    pub tasks: Vec<TaskSpec>,
    /// Behavior sets, in the order of their tasks.
    pub sets: Vec<BehaviorSpec>,
    task_ids: BTreeMap<String, TaskId>,
}

impl Catalog {
    /// The catalog of a scenario. That of a run stands in its [`Setup`](super::Setup).
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let mission = scenario.mission();
        let (names, sets) = mission.catalog(scenario);
        let tasks = names.into_iter().zip(0..).map(|(name, id)| {
            let section = scenario.tasks.get(&name).copied().unwrap_or_default();
            let max_robots = section.max_robots.or_else(|| {
                let behavior = sets.get(sets.partition_point(|set| set.task < TaskId(id)))?;
                Some(mission.max_robots(scenario, behavior))
            });
            TaskSpec {
                max_robots: max_robots.unwrap_or(1),
                priority: section.priority,
                name,
            }
        });
        let tasks: Vec<TaskSpec> = tasks.collect();
        let names = tasks.iter().map(|task| task.name.clone());
        Self {
            task_ids: names.zip((0..=u16::MAX).map(TaskId)).collect(),
            mission,
            tasks,
            sets,
        }
    }

    /// The behavior set of that name.
    #[must_use]
    pub fn behavior_named(&self, name: &str) -> Option<BehaviorId> {
        let index = self.sets.iter().position(|set| set.name == name)?;
        Some(BehaviorId(index as u16))
    }

    /// Name of a task; ids come from this catalog.
    #[must_use]
    pub fn task_name(&self, task: TaskId) -> &str {
        self.tasks.get(task.index()).map_or("?", |task| &task.name)
    }

    /// Name of a behavior set; ids come from this catalog.
    #[must_use]
    pub fn behavior_name(&self, set: BehaviorId) -> &str {
        self.sets.get(set.index()).map_or("?", |set| &set.name)
    }

    /// The behavior sets of one robot, in the catalog's order: those for its tasks that the mission gives it.
    pub fn behaviors_of<'c>(&'c self, robot: &'c Robot) -> impl Iterator<Item = BehaviorId> + 'c {
        let named = robot.tasks.iter().filter_map(|name| self.task_named(name));
        let mut tasks: Vec<TaskId> = named.collect();
        if robot.tasks.is_empty() {
            tasks = (0..self.tasks.len() as u16).map(TaskId).collect();
        }
        tasks.sort_unstable();
        tasks.dedup();
        tasks
            .into_iter()
            .flat_map(|task| self.behaviors_for(task))
            .filter(|&set| {
                let behavior = &self.sets[set];
                robot.skill_at(behavior) > 0.0 && self.mission.has_behavior(robot, behavior)
            })
            .map(|index| BehaviorId(index as u16))
    }

    /// The task of that name.
    #[must_use]
    pub fn task_named(&self, name: &str) -> Option<TaskId> {
        self.task_ids.get(name).copied()
    }

    /// The behavior sets for a task: sets are in the order of their tasks.
    fn behaviors_for(&self, task: TaskId) -> Range<usize> {
        let from = self.sets.partition_point(|set| set.task < task);
        let to = self.sets.partition_point(|set| set.task <= task);
        from..to
    }
}
