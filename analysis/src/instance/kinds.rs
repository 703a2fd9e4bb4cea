//! The kinds of work of a scenario, computed from the tasks of an instance.
//!
//! A kind has one name, one number of workers and, unless points can state deadlines, one deadline. Tasks that differ in
//! them need kinds of their own, whose names have a number: `arm`, `arm-2`.

use std::collections::BTreeMap;

use missions::service::data::MAX_KINDS;

use super::model::{Instance, Task};
use super::properties::Supported;

/// The name of the kind of tasks without a required skill.
const ANY_SKILL: &str = "task";

/// A kind of work.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkKind {
    pub name: String,
    /// The skill that a robot needs; `None` if each robot can do the work.
    pub skill: Option<String>,
    pub workers: u32,
    pub deadline_s: Option<f64>,
    /// The least and the greatest work of its tasks, s.
    pub work_s: [f64; 2],
}

/// A task in terms of the mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The index of the kind.
    pub kind: usize,
    /// The task with the times that the scenario states.
    pub task: Task,
}

/// The kinds and points of an instance, and the facts that they cannot express, each with the number of tasks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    pub kinds: Vec<WorkKind>,
    pub points: Vec<Point>,
    pub notes: Vec<String>,
}

/// The shortest work that the mission accepts, s.
const SHORTEST_S: f64 = 0.001;

/// Returns the kinds and points of an instance for a mission with these properties of points. The result may have more
/// kinds than a scenario accepts.
#[must_use]
pub fn points(instance: &Instance, supported: &Supported) -> Points {
    let with_deadlines = lowered(instance, supported, true);
    if with_deadlines.kinds.len() <= MAX_KINDS {
        return with_deadlines;
    }
    let kinds = with_deadlines.kinds.len();
    let mut without = lowered(instance, supported, false);
    let count = instance
        .tasks
        .iter()
        .filter(|task| task.deadline_s.is_some())
        .count();
    without.notes.push(dropped(
        "deadline_s",
        count,
        &format!("a deadline belongs to a kind, and the tasks would need {kinds} of at most {MAX_KINDS} kinds"),
    ));
    without
}

/// Returns a note about a property of `count` tasks that the scenario does not state.
#[must_use]
pub fn dropped(name: &str, count: usize, reason: &str) -> String {
    format!("dropped: {name} of {}: {reason}", tasks(count))
}

fn changed(name: &str, count: usize, effect: &str) -> Option<String> {
    (count > 0).then(|| format!("changed: {name} of {} {effect}", tasks(count)))
}

fn tasks(count: usize) -> String {
    match count {
        1 => "1 task".to_owned(),
        more => format!("{more} tasks"),
    }
}

fn lowered(instance: &Instance, supported: &Supported, keep_deadlines: bool) -> Points {
    let any_skill = any_skill(instance);
    let mut result = Points::default();
    let mut by_terms = BTreeMap::new();
    let mut same_name = BTreeMap::new();
    let (mut made_longer, mut coalitions, mut several_skills) = (0, 0, 0);
    for task in &instance.tasks {
        let mut stated = task.clone();
        stated.work_s = task.work_s.max(SHORTEST_S);
        stated.deadline_s = task.deadline_s.filter(|_| keep_deadlines);
        made_longer += usize::from(task.work_s < SHORTEST_S);
        let (skill, workers) = skill_and_workers(task, supported);
        if !supported.has("needs") && !task.needs.is_empty() {
            several_skills += usize::from(task.needs.len() > 1 || task.kind.is_some());
            coalitions += usize::from(task.kind.is_none() && workers > 1);
        }
        let deadline_s = stated.deadline_s.filter(|_| !supported.has("deadline_s"));
        let terms = (skill.clone(), workers, deadline_s.map(f64::to_bits));
        let kind = *by_terms.entry(terms).or_insert_with(|| {
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
                deadline_s,
                work_s: [f64::INFINITY, 0.0],
            });
            result.kinds.len() - 1
        });
        let [least, most] = &mut result.kinds[kind].work_s;
        *least = least.min(stated.work_s);
        *most = most.max(stated.work_s);
        result.points.push(Point { kind, task: stated });
    }
    result.notes.extend(
        [
            changed("work_s", made_longer, "became 0.001 s, the shortest work"),
            changed(
                "needs",
                coalitions,
                "became workers: fewer robots can do the work, too",
            ),
            changed(
                "needs",
                several_skills,
                "lost all skills but one: the mission asks for one",
            ),
        ]
        .into_iter()
        .flatten(),
    );
    result
}

/// Returns the skill of a task's kind and the number of its workers.
fn skill_and_workers(task: &Task, supported: &Supported) -> (Option<String>, u32) {
    let first = task.needs.iter().next();
    let first = first.filter(|_| task.kind.is_none() && !supported.has("needs"));
    let skill = task.kind.clone().or(first.map(|(skill, _)| skill.clone()));
    let workers = task.workers.or(first.map(|(_, count)| *count));
    (skill, workers.unwrap_or(1))
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
