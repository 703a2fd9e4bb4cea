//! Checks of an instance before its scenario is written, each with the line of the record.

use std::collections::{BTreeMap, BTreeSet};

use scenario::limits::{
    DEMAND, LENGTH, NumberRange, PENETRABILITY, SPEED, TIME, TIME_OR_ZERO, TURN_RATE, check_name,
    closed, whole,
};
use scenario::names::RESERVED;
use scenario::{MAX_ROBOTS, Problem, name_remedy};

use super::model::{Robot, Task};
use super::source::{Loaded, Source};

/// The most tasks of a scenario.
pub const MAX_TASKS: usize = missions::service::data::MAX_POINTS;

/// The coordinates of places, in units of the file.
const PLACE: NumberRange = closed(-1e9, 1e9, "");
/// The values, priorities and demands of tasks. Demands below 0 have no effect.
const ANY: NumberRange = closed(-1e12, 1e12, "");
const LEVEL: NumberRange = closed(0.0, 1e3, "");
const WORKERS: NumberRange = whole(1, 100, "");

/// Checks the records of an instance: names, ranges, windows, references, precedence and skills.
///
/// # Errors
/// Returns the first mistake with its line.
pub fn check(loaded: &Loaded, source: Source<'_>) -> Result<(), Problem> {
    let instance = &loaded.instance;
    let count = |name: &str, count: usize, most: usize| {
        if (1..=most).contains(&count) {
            return Ok(());
        }
        let what = format!("{count} {name}");
        Err(Problem::with_source(
            source.name,
            what,
            format!("give 1 to {most}"),
        ))
    };
    count("tasks", instance.tasks.len(), MAX_TASKS)?;
    count("robots", instance.robots.len(), MAX_ROBOTS)?;
    for (key, value, range) in [
        ("limit_s", instance.limit_s, TIME),
        ("speed_m_s", instance.speed_m_s, SPEED),
        ("turn_deg_s", instance.turn_deg_s, TURN_RATE),
        (
            "robot_penetrability",
            instance.robot_penetrability,
            PENETRABILITY,
        ),
        ("reach_m", instance.reach_m, LENGTH),
    ] {
        if let Some(value) = value {
            let checked = range.check([key], value);
            checked
                .map_err(|problem| Problem::with_source(source.name, problem.to_string(), ""))?;
        }
    }
    let mut ids = BTreeMap::new();
    for (index, task) in instance.tasks.iter().enumerate() {
        let line = loaded.task_line(index);
        let at =
            |problem: Problem| source.error(line, format!("task '{}': {problem}", task.id), "");
        of_task(task).map_err(at)?;
        if let Some(first) = ids.insert(task.id.as_str(), index) {
            let what = format!(
                "'{}' is already the id of a task on line {}",
                task.id,
                loaded.task_line(first)
            );
            return Err(source.error(line, what, "give each task its own id"));
        }
    }
    let mut names = BTreeMap::new();
    for (index, robot) in instance.robots.iter().enumerate() {
        let line = loaded.robot_line(index);
        let at =
            |problem: Problem| source.error(line, format!("robot '{}': {problem}", robot.id), "");
        of_robot(robot).map_err(at)?;
        if let Some(first) = names.insert(robot.id.as_str(), index) {
            let what = format!(
                "'{}' is already the id of a robot on line {}",
                robot.id,
                loaded.robot_line(first)
            );
            return Err(source.error(line, what, "give each robot its own id"));
        }
    }
    precedence(loaded, source, &ids)?;
    loads(loaded, source)?;
    skills(loaded, source)
}

fn of_task(task: &Task) -> Result<(), Problem> {
    if task.id.is_empty() {
        return Err(Problem::at(["id"], "it is empty", "give each task an id"));
    }
    let [to_x, to_y] = task.deliver_to.unwrap_or_default();
    for (key, value, range) in [
        ("x_m", task.x_m, PLACE),
        ("y_m", task.y_m, PLACE),
        ("deliver_to", to_x, PLACE),
        ("deliver_to", to_y, PLACE),
        ("work_s", task.work_s, TIME_OR_ZERO),
        ("arrival_s", task.arrival_s, TIME_OR_ZERO),
        ("opens_s", task.opens_s.unwrap_or(0.0), TIME_OR_ZERO),
        ("deadline_s", task.deadline_s.unwrap_or(1.0), TIME),
        ("value", task.value.unwrap_or(0.0), ANY),
        ("demand", task.demand.unwrap_or(0.0), ANY),
        ("workers", task.workers.unwrap_or(1).into(), WORKERS),
    ] {
        range.check([key], value)?;
    }
    for (skill, count) in &task.needs {
        check_name(["needs"], skill)?;
        WORKERS.check(["needs"], *count)?;
    }
    if let Some(kind) = &task.kind {
        check_name(["kind"], kind)?;
    }
    if let (Some(opens_s), Some(deadline_s)) = (task.opens_s, task.deadline_s)
        && opens_s >= deadline_s
    {
        let what =
            format!("the window opens {opens_s} s and closes {deadline_s} s after the arrival");
        return Err(Problem::at(
            ["opens_s"],
            what,
            "let it open before it closes",
        ));
    }
    Ok(())
}

fn of_robot(robot: &Robot) -> Result<(), Problem> {
    check_name(["id"], &robot.id)?;
    if let Some((_, means)) = RESERVED.iter().find(|(reserved, _)| *reserved == robot.id) {
        return Err(Problem::at(
            ["id"],
            format!("the name means {means}"),
            "choose another name",
        ));
    }
    if robot.x_m.is_some() != robot.y_m.is_some() {
        return Err(Problem::at(
            ["x_m"],
            "one coordinate is missing",
            "give x_m and y_m, or none",
        ));
    }
    for (key, value, range) in [
        ("x_m", robot.x_m.unwrap_or(0.0), PLACE),
        ("y_m", robot.y_m.unwrap_or(0.0), PLACE),
        ("speed_m_s", robot.speed_m_s.unwrap_or(1.0), SPEED),
        ("capacity", robot.capacity.unwrap_or(0.0), DEMAND),
    ] {
        range.check([key], value)?;
    }
    for (skill, level) in robot.skills.iter().flatten() {
        check_name(["skills"], skill)?;
        LEVEL.check(["skills"], *level)?;
    }
    Ok(())
}

/// Rejects unknown predecessors and cycles.
fn precedence(
    loaded: &Loaded,
    source: Source<'_>,
    ids: &BTreeMap<&str, usize>,
) -> Result<(), Problem> {
    let tasks = &loaded.instance.tasks;
    // The number of predecessors of each task that are not yet in the order.
    let mut waiting = vec![0_usize; tasks.len()];
    let mut successors = vec![Vec::new(); tasks.len()];
    for (index, task) in tasks.iter().enumerate() {
        for before in &task.after {
            let Some(first) = ids.get(before.as_str()) else {
                let what = format!("task '{}': after: there is no task '{before}'", task.id);
                let remedy = name_remedy(before, ids.keys().copied());
                return Err(source.error(loaded.task_line(index), what, remedy));
            };
            waiting[index] += 1;
            successors[*first].push(index);
        }
    }
    let mut ready: Vec<usize> = (0..tasks.len())
        .filter(|task| waiting[*task] == 0)
        .collect();
    while let Some(done) = ready.pop() {
        for next in &successors[done] {
            waiting[*next] -= 1;
            if waiting[*next] == 0 {
                ready.push(*next);
            }
        }
    }
    match (0..tasks.len()).find(|task| waiting[*task] > 0) {
        None => Ok(()),
        Some(index) => {
            let what = format!(
                "task '{}': after: it waits for itself, by a cycle",
                tasks[index].id
            );
            Err(source.error(
                loaded.task_line(index),
                what,
                "remove one of the predecessors",
            ))
        }
    }
}

/// Rejects a demand above the capacities of all robots. A robot without a stated capacity carries any load.
fn loads(loaded: &Loaded, source: Source<'_>) -> Result<(), Problem> {
    let capacities = loaded.instance.robots.iter().map(|robot| robot.capacity);
    let Some(capacities) = capacities.collect::<Option<Vec<f64>>>() else {
        return Ok(());
    };
    let most = capacities.into_iter().fold(0.0, f64::max);
    let mut demands = loaded.instance.tasks.iter().map(Task::load).enumerate();
    let heavy =
        demands.find_map(|(index, demand)| Some((index, demand.filter(|demand| *demand > most)?)));
    heavy.map_or(Ok(()), |(index, demand)| {
        let task = &loaded.instance.tasks[index];
        let what = format!("task '{}': no robot has a capacity of {demand}", task.id);
        let remedy = "reduce the demand, or give a robot more capacity";
        Err(source.error(loaded.task_line(index), what, remedy))
    })
}

/// Rejects a task that no robot can do. A robot without stated skills has all of them.
fn skills(loaded: &Loaded, source: Source<'_>) -> Result<(), Problem> {
    let robots = &loaded.instance.robots;
    let present: Option<BTreeSet<&str>> = robots
        .iter()
        .map(|robot| robot.skills.as_ref())
        .collect::<Option<Vec<_>>>()
        .map(|skills| {
            let skills = skills.into_iter().flatten();
            let present = skills.filter(|(_, level)| **level > 0.0);
            present.map(|(skill, _)| skill.as_str()).collect()
        });
    let Some(present) = present else {
        return Ok(());
    };
    for (index, task) in loaded.instance.tasks.iter().enumerate() {
        let needed = task.needs.keys().chain(&task.kind);
        for skill in needed {
            if !present.contains(skill.as_str()) {
                let what = format!("task '{}': no robot has the skill {skill}", task.id);
                let remedy = name_remedy(skill, present.iter().copied());
                return Err(source.error(loaded.task_line(index), what, remedy));
            }
        }
    }
    Ok(())
}
