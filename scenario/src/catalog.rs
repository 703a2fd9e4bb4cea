//! The tasks and behavior sets of a mission, with the ids that messages use.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Robot, Scenario};
use crate::ids::{BehaviorId, TaskId};
use crate::mission::registry::Mission;

/// A task of the mission (thesis §3.3.1).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskSpec {
    /// The name, as in the logs.
    pub name: String,
    /// The number of robots that may execute it at once; 1 is exclusive.
    pub max_robots: u32,
    /// The priority. A higher number goes first.
    pub priority: i32,
    /// The first task of the group that robots must execute at the same time, if the task belongs to one.
    pub coalition: Option<TaskId>,
}

/// A behavior set, which performs one task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BehaviorSpec {
    /// The name, as in the logs and parameter files.
    pub name: String,
    /// The task that the set performs.
    pub task: TaskId,
    /// The kind of behavior, a number that the mission defines.
    pub kind: u32,
    /// The required skill, if any. A robot without it does not have the behavior.
    pub skill: Option<String>,
}

/// The tasks and behavior sets of a scenario. The index of each is its id.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Catalog {
    /// The mission of the tasks and behavior sets.
    pub mission: Mission,
    /// The tasks, indexed by id.
    pub tasks: Vec<TaskSpec>,
    /// The behavior sets, in the order of their tasks.
    pub sets: Vec<BehaviorSpec>,
    task_ids: BTreeMap<String, TaskId>,
}

impl Catalog {
    /// Creates the catalog of a scenario. A run's [`Setup`](super::Setup) contains its catalog.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let mission = scenario.mission();
        let (names, sets) = mission.catalog(scenario);
        let tasks = names.into_iter().zip(0..).map(|(name, id)| {
            let section = scenario.tasks.get(&name).copied().unwrap_or_default();
            let behavior = sets.get(sets.partition_point(|set| set.task < TaskId(id)));
            let properties =
                behavior.map(|behavior| mission.behavior_properties(scenario, behavior));
            let properties = properties.unwrap_or_default();
            TaskSpec {
                max_robots: section.max_robots.unwrap_or(properties.max_robots),
                priority: match section.priority {
                    0 => properties.priority,
                    stated => stated,
                },
                coalition: None,
                name,
            }
        });
        let mut tasks: Vec<TaskSpec> = tasks.collect();
        for coalition in mission.coalitions(scenario) {
            for task in &coalition {
                // The scenario may not be checked yet.
                if let Some(task) = tasks.get_mut(task.index()) {
                    task.coalition = coalition.first().copied();
                }
            }
        }
        let names = tasks.iter().map(|task| task.name.clone());
        Self {
            task_ids: names.zip((0..=u32::MAX).map(TaskId)).collect(),
            mission,
            tasks,
            sets,
        }
    }

    /// Returns the id of the behavior set with this name.
    #[must_use]
    pub fn find_behavior(&self, name: &str) -> Option<BehaviorId> {
        let index = self.sets.iter().position(|set| set.name == name)?;
        Some(BehaviorId(index as u32))
    }

    /// Returns the name of a task of this catalog.
    #[must_use]
    pub fn task_name(&self, task: TaskId) -> &str {
        self.tasks.get(task.index()).map_or("?", |task| &task.name)
    }

    /// Returns the name of a behavior set of this catalog.
    #[must_use]
    pub fn behavior_name(&self, set: BehaviorId) -> &str {
        self.sets.get(set.index()).map_or("?", |set| &set.name)
    }

    /// Returns the behavior sets of one robot in catalog order: those of its tasks that the mission allows.
    pub fn behaviors_of<'c>(&'c self, robot: &'c Robot) -> impl Iterator<Item = BehaviorId> + 'c {
        let named = robot.tasks.iter().filter_map(|name| self.find_task(name));
        let mut tasks: Vec<TaskId> = named.collect();
        if robot.tasks.is_empty() {
            tasks = (0..self.tasks.len() as u32).map(TaskId).collect();
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
            .map(|index| BehaviorId(index as u32))
    }

    /// Returns the id of the task with this name.
    #[must_use]
    pub fn find_task(&self, name: &str) -> Option<TaskId> {
        self.task_ids.get(name).copied()
    }

    /// Returns the index range of a task's behavior sets, which are in the order of their tasks.
    fn behaviors_for(&self, task: TaskId) -> Range<usize> {
        let from = self.sets.partition_point(|set| set.task < task);
        let to = self.sets.partition_point(|set| set.task <= task);
        from..to
    }
}
