//! Sadcher's JSON files (Bichler, Bos, Tan and Alonso-Mora, IEEE MRS 2025): matrices of robots and tasks.
//!
//! `Q` has the skills of each robot, 0 or 1, and `R` those that each task needs at once, each by one robot. `T_e` has the
//! execution times and `task_locations` the places. The first task is the start of all robots and the last one is their
//! exit. `precedence_constraints` has pairs of tasks, the first before the second. Distances have no unit; a robot
//! drives one unit per unit of time.

use std::collections::BTreeMap;

use scenario::Problem;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;

use super::super::model::{Robot, Task};
use super::super::source::{Loaded, Source};
use super::json::refused;

/// The matrices of a file. Each keeps its text for its place.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File<'a> {
    #[serde(rename = "Q", borrow)]
    skills: &'a RawValue,
    #[serde(rename = "R", borrow)]
    needs: &'a RawValue,
    #[serde(rename = "T_e", borrow)]
    durations: &'a RawValue,
    /// Times between the places, which the places determine.
    #[serde(rename = "T_t", default)]
    _travel: Option<IgnoredAny>,
    #[serde(borrow)]
    task_locations: &'a RawValue,
    #[serde(default, borrow)]
    precedence_constraints: Option<&'a RawValue>,
}

/// Returns true if the text has the keys of Sadcher's files.
pub(super) fn has_matrices(text: &str) -> bool {
    ["\"Q\"", "\"R\"", "\"T_e\"", "\"task_locations\""]
        .iter()
        .all(|key| text.contains(key))
}

/// A value with the line of its text.
struct Placed<T> {
    value: T,
    line: usize,
}

/// Reads one of Sadcher's files.
///
/// # Errors
/// Returns the first line that does not fit.
pub(super) fn read(source: Source<'_>) -> Result<Loaded, Problem> {
    let file: File<'_> =
        serde_json::from_str(source.text).map_err(|error| refused(source, &error, 1))?;
    let skills: Vec<Placed<Vec<f64>>> = rows(source, file.skills)?;
    let needs: Vec<Placed<Vec<f64>>> = rows(source, file.needs)?;
    let durations: Vec<Placed<f64>> = rows(source, file.durations)?;
    let places: Vec<Placed<[f64; 2]>> = rows(source, file.task_locations)?;
    let pairs: Vec<Placed<[usize; 2]>> = match file.precedence_constraints {
        Some(pairs) if pairs.get() != "null" => rows(source, pairs)?,
        _ => Vec::new(),
    };
    let count = places.len();
    for (name, raw, length) in [
        ("R", file.needs, needs.len()),
        ("T_e", file.durations, durations.len()),
    ] {
        if length != count {
            let what = format!("{name} has {length} rows, and task_locations has {count}");
            return Err(source.error(
                line_of(source, raw),
                what,
                "give one per task, with start and exit",
            ));
        }
    }
    if count < 2 {
        let what = "task_locations has no start and exit";
        return Err(source.error(line_of(source, file.task_locations), what, "add both"));
    }
    let width = skills.first().map_or(0, |row| row.value.len());
    for (name, row) in skills
        .iter()
        .map(|row| ("Q", row))
        .chain(needs.iter().map(|row| ("R", row)))
    {
        if row.value.len() != width {
            let what = format!(
                "a row of {name} has {} skills, and the first row of Q has {width}",
                row.value.len()
            );
            return Err(source.error(row.line, what, "give all rows the same skills"));
        }
        if let Some(other) = row.value.iter().find(|level| ![0.0, 1.0].contains(*level)) {
            let what = format!("{name}: {other} is neither 0 nor 1");
            return Err(source.error(row.line, what, "write 1 for a skill, or 0"));
        }
    }
    let mut loaded = Loaded {
        task_lines: places[1..count - 1]
            .iter()
            .map(|place| place.line)
            .collect(),
        robot_lines: skills.iter().map(|row| row.line).collect(),
        ..Loaded::without_units()
    };
    let [x, y] = places[0].value;
    loaded
        .dropped
        .push("exit: robots stay at their last task".to_owned());
    let instance = &mut loaded.instance;
    let named = |row: &[f64]| -> Vec<String> {
        let present = row.iter().enumerate().filter(|(_, level)| **level == 1.0);
        present.map(|(skill, _)| format!("s{skill}")).collect()
    };
    instance.robots = (0..)
        .zip(&skills)
        .map(|(robot, row)| Robot {
            id: format!("r{robot}"),
            x_m: Some(x),
            y_m: Some(y),
            skills: Some(
                named(&row.value)
                    .into_iter()
                    .map(|skill| (skill, 1.0))
                    .collect(),
            ),
            ..Robot::default()
        })
        .collect();
    instance.tasks = (1..count - 1)
        .map(|task| Task {
            id: task_id(task),
            x_m: places[task].value[0],
            y_m: places[task].value[1],
            work_s: durations[task].value,
            needs: named(&needs[task].value)
                .into_iter()
                .map(|skill| (skill, 1))
                .collect::<BTreeMap<_, _>>(),
            ..Task::default()
        })
        .collect();
    for pair in pairs {
        let [first, second] = pair.value;
        // The start precedes and the exit follows each task anyway.
        if first == 0 || second == count - 1 {
            continue;
        }
        if first >= count - 1 || second == 0 || second >= count {
            let what = format!(
                "precedence of {first} and {second}: there are tasks 1 to {}",
                count - 2
            );
            return Err(source.error(pair.line, what, "name two of them"));
        }
        instance.tasks[second - 1].after.push(task_id(first));
    }
    Ok(loaded)
}

fn task_id(task: usize) -> String {
    format!("t{task}")
}

/// Returns the line on which a part of the text begins.
fn line_of(source: Source<'_>, raw: &RawValue) -> usize {
    source.line_at(raw.get().as_ptr().addr() - source.text.as_ptr().addr())
}

/// Reads a list and returns its elements with their lines.
fn rows<'a, T: Deserialize<'a>>(
    source: Source<'a>,
    raw: &'a RawValue,
) -> Result<Vec<Placed<T>>, Problem> {
    let first = line_of(source, raw);
    let elements: Vec<&RawValue> =
        serde_json::from_str(raw.get()).map_err(|error| refused(source, &error, first))?;
    let elements = elements.into_iter().map(|element| {
        let line = line_of(source, element);
        let value = serde_json::from_str(element.get());
        let value = value.map_err(|error| refused(source, &error, line))?;
        Ok(Placed { value, line })
    });
    elements.collect()
}
