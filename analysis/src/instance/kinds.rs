//! The kinds of work of a scenario, computed from the tasks of an instance.
//!
//! A kind has one skill and one number of workers. Tasks of one skill that differ in the number of workers need kinds of
//! their own, whose names have a number: `arm`, `arm-2`.

use std::collections::BTreeMap;

use super::model::{Instance, Task};

/// The name of the kind of tasks without a required skill.
const ANY_SKILL: &str = "task";

/// A kind of work.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkKind {
    pub name: String,
    /// The skill that a robot needs; `None` if each robot can do the work.
    pub skill: Option<String>,
    pub workers: u32,
    /// The least and the greatest work of its tasks, s.
    pub work_s: [f64; 2],
}

/// A task in terms of the mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The index of the kind.
    pub kind: usize,
    /// The task with the work that the scenario states.
    pub task: Task,
}

/// The kinds and points of an instance, and notes about what they state in another way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    pub kinds: Vec<WorkKind>,
    pub points: Vec<Point>,
    pub notes: Vec<String>,
}

/// The shortest work that the mission accepts, s.
const SHORTEST_S: f64 = 0.001;

/// Returns the kinds and points of an instance. The result may have more kinds than a scenario accepts.
#[must_use]
pub fn points(instance: &Instance) -> Points {
    let any_skill = any_skill(instance);
    let mut result = Points::default();
    let mut by_terms = BTreeMap::new();
    let mut same_name = BTreeMap::new();
    let mut made_longer = 0;
    for task in &instance.tasks {
        let mut stated = task.clone();
        stated.work_s = task.work_s.max(SHORTEST_S);
        made_longer += usize::from(task.work_s < SHORTEST_S);
        let (skill, workers) = (task.kind.clone(), task.workers.unwrap_or(1));
        let kind = *by_terms.entry((skill.clone(), workers)).or_insert_with(|| {
            let base = skill.clone().unwrap_or_else(|| any_skill.clone());
            let number: &mut u32 = same_name.entry(base.clone()).or_default();
            *number += 1;
            let name = match number {
                1 => base,
                number => format!("{base}-{number}"),
            };
            result.kinds.push(WorkKind {
                name,
                skill,
                workers,
                work_s: [f64::INFINITY, 0.0],
            });
            result.kinds.len() - 1
        });
        let [least, most] = &mut result.kinds[kind].work_s;
        *least = least.min(stated.work_s);
        *most = most.max(stated.work_s);
        result.points.push(Point { kind, task: stated });
    }
    if made_longer > 0 {
        result.notes.push(format!(
            "changed: work_s of {} became 0.001 s, the shortest work",
            tasks(made_longer)
        ));
    }
    result
}

/// Returns a note about a property of `count` tasks that the scenario does not state.
#[must_use]
pub fn dropped(name: &str, count: usize, reason: &str) -> String {
    format!("dropped: {name} of {}: {reason}", tasks(count))
}

fn tasks(count: usize) -> String {
    match count {
        1 => "1 task".to_owned(),
        more => format!("{more} tasks"),
    }
}

/// Returns a name for work without a skill that is not the name of a skill.
fn any_skill(instance: &Instance) -> String {
    let is_skill = |name: &str| {
        let of_task =
            |task: &Task| task.kind.as_deref() == Some(name) || task.needs.contains_key(name);
        let mut robots = instance.robots.iter();
        instance.tasks.iter().any(of_task)
            || robots.any(|robot| robot.skills.iter().any(|skills| skills.contains_key(name)))
    };
    let mut name = ANY_SKILL.to_owned();
    while is_skill(&name) {
        name = format!("any-{name}");
    }
    name
}
