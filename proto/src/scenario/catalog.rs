//! The tasks and behavior sets of a mission, with the ids that cross the bus.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Robot, Scenario};
use crate::ids::{BehaviorId, TaskId};

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

/// What a behavior set does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BehaviorKind {
    /// Follow the walls with the side sensor.
    FindLocationsMethodical,
    /// Wander west, north, east, south.
    FindLocationsWander,
    /// Carry the items of one spill to the deposit; the spill by its place in the scenario.
    MoveSpill(u16),
    /// Report at the report site.
    ReportProgress,
}

/// A behavior set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BehaviorSpec {
    /// Name, as in the logs and parameter files.
    pub name: String,
    /// The task that it performs.
    pub task: TaskId,
    /// What it does.
    pub kind: BehaviorKind,
}

/// All tasks and behavior sets of a scenario; the index of each is its id.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Catalog {
    /// Tasks: find-locations, move-spill(NAME) of each spill, report-progress.
    pub tasks: Vec<TaskSpec>,
    /// Behavior sets: find-locations-methodical, find-locations-wander, move-spill(NAME) of each spill, report-progress.
    pub sets: Vec<BehaviorSpec>,
    task_ids: BTreeMap<String, TaskId>,
}

impl Catalog {
    /// The catalog of a scenario. That of a run stands in its [`Setup`](super::Setup).
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let task = |name: String| {
            let section = scenario.tasks.get(&name).copied().unwrap_or_default();
            TaskSpec {
                max_robots: section.max_robots,
                priority: section.priority,
                name,
            }
        };
        let move_spill =
            |index: usize| format!("move-spill({})", scenario.waste.spills[index].name);
        let spills = scenario.waste.spills.len();
        let mut tasks = vec![task("find-locations".to_owned())];
        tasks.extend((0..spills).map(|index| task(move_spill(index))));
        tasks.push(task("report-progress".to_owned()));

        let find = |name: &str, kind| BehaviorSpec {
            name: name.to_owned(),
            task: TaskId(0),
            kind,
        };
        let mut sets = vec![
            find(
                "find-locations-methodical",
                BehaviorKind::FindLocationsMethodical,
            ),
            find("find-locations-wander", BehaviorKind::FindLocationsWander),
        ];
        sets.extend((0..spills as u16).map(|index| BehaviorSpec {
            name: move_spill(usize::from(index)),
            task: TaskId(index + 1),
            kind: BehaviorKind::MoveSpill(index),
        }));
        sets.push(BehaviorSpec {
            name: "report-progress".to_owned(),
            task: TaskId(spills as u16 + 1),
            kind: BehaviorKind::ReportProgress,
        });
        let task_ids = (0..).map(TaskId);
        Self {
            task_ids: tasks
                .iter()
                .map(|task| task.name.clone())
                .zip(task_ids)
                .collect(),
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

    /// The behavior sets of one robot, in the catalog's order: those for its tasks, but find-locations-methodical only with
    /// a side sensor.
    pub fn behaviors_of(&self, robot: &Robot) -> impl Iterator<Item = BehaviorId> + '_ {
        let side_sensor = robot.has_device(Robot::SIDE_BORDER);
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
            .filter(move |&set| {
                side_sensor || self.sets[set].kind != BehaviorKind::FindLocationsMethodical
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
