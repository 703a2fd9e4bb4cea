//! An allocation as text and as JSON.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use scenario::Setup;
use scenario::ids::TaskId;
use serde_json::{Value, json};

use super::{Allocation, STABLE_ROUNDS};

/// The number of tasks in the text that a line of a robot lists.
const LISTED: usize = 12;

fn names<'a>(setup: &'a Setup, tasks: &BTreeSet<TaskId>) -> Vec<&'a str> {
    tasks
        .iter()
        .map(|task| setup.catalog.task_name(*task))
        .collect()
}

/// Returns the allocation for people: a line per robot, then the counts.
#[must_use]
pub fn text(setup: &Setup, allocation: &Allocation) -> String {
    let mut text = String::new();
    let width = setup
        .scenario
        .robots
        .iter()
        .map(|robot| robot.name.len())
        .max();
    let width = width.unwrap_or(0);
    for (rank, (robot, tasks)) in setup
        .scenario
        .robots
        .iter()
        .zip(&allocation.robots)
        .enumerate()
    {
        let names = names(setup, tasks);
        let more = names.len().saturating_sub(LISTED);
        let mut line = names[..names.len() - more].join(" ");
        if more > 0 {
            line += &format!(" and {more} more");
        }
        if let Some(objective) = allocation.objective.as_ref().filter(|_| !tasks.is_empty()) {
            line += &format!("  ({:.1} s)", objective.robots_s[rank]);
        }
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{:width$}  {}",
            robot.name,
            if line.is_empty() { "-" } else { &line }
        );
    }
    let state = match allocation.is_stable {
        true => format!("stable: no change in the next {STABLE_ROUNDS}"),
        false => "not stable".to_owned(),
    };
    let _ = writeln!(text, "rounds     {} ({state})", allocation.rounds);
    let _ = writeln!(
        text,
        "messages   {} of the allocator, {} heartbeats, {} bytes",
        allocation.messages, allocation.heartbeats, allocation.bytes
    );
    if let Some(objective) = &allocation.objective {
        let _ = writeln!(
            text,
            "assigned   {} of {} tasks, {} of them to several robots",
            objective.assigned, objective.tasks, objective.shared
        );
        let _ = writeln!(
            text,
            "objective  {:.1} s in all, {:.1} s for the last robot",
            objective.sum_s(),
            objective.longest_s()
        );
    }
    text
}

/// Returns the allocation for programs.
#[must_use]
pub fn json(setup: &Setup, allocation: &Allocation) -> Value {
    let robots = setup
        .scenario
        .robots
        .iter()
        .zip(&allocation.robots)
        .enumerate();
    let robots = robots.map(|(rank, (robot, tasks))| {
        let time_s = allocation
            .objective
            .as_ref()
            .map(|objective| objective.robots_s[rank]);
        json!({ "robot": robot.name, "tasks": names(setup, tasks), "time_s": time_s })
    });
    json!({
        "allocator": setup.scenario.allocator_list(),
        "seed": setup.seed,
        "robots": robots.collect::<Vec<Value>>(),
        "rounds": allocation.rounds,
        "stable": allocation.is_stable,
        "messages": allocation.messages,
        "heartbeats": allocation.heartbeats,
        "bytes": allocation.bytes,
        "objective": allocation.objective.as_ref().map(|objective| json!({
            "assigned": objective.assigned,
            "shared": objective.shared,
            "tasks": objective.tasks,
            "sum_s": objective.sum_s(),
            "longest_s": objective.longest_s(),
        })),
    })
}
