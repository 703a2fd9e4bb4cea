//! Assignment of tasks before the start, with the Hungarian method, for allocators that
//! [use](super::Allocator::uses_assignment) it. Each round assigns one task per robot at the least total cost. The
//! loads of earlier rounds count in the costs of the next one. Tasks of a coalition are assigned before, all at once.

use std::sync::Arc;

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;
use scenario::ids::{RobotId, TaskId};

/// The cost of an impossible pair, ms; larger than any sum of real costs.
const NEVER: i64 = 1 << 40;

/// Assigns every feasible task to one robot, and returns the tasks of each robot, by rank. `cost_ms` has a row per
/// robot and a column per task; `None` marks an impossible pair. Tasks of a coalition go to different robots. Those
/// without a robot stay unassigned.
#[must_use]
pub fn assign(cost_ms: &[Vec<Option<i64>>], coalitions: &[Vec<TaskId>]) -> Vec<Arc<[TaskId]>> {
    let tasks = cost_ms.first().map_or(0, Vec::len);
    let mut assigned: Vec<Vec<TaskId>> = vec![Vec::new(); cost_ms.len()];
    let mut load_ms = vec![0; cost_ms.len()];
    let mut assign_at_once = |assigned: &mut Vec<Vec<TaskId>>, tasks: &[usize]| {
        let cost = |robot: usize, task: usize| match cost_ms[robot][tasks[task]] {
            Some(cost_ms) => load_ms[robot] + cost_ms,
            None => NEVER,
        };
        let mut pairs = least_cost(cost_ms.len(), tasks.len(), &cost);
        pairs.retain(|&(robot, task)| cost_ms[robot][tasks[task]].is_some());
        for &(robot, task) in &pairs {
            load_ms[robot] += cost_ms[robot][tasks[task]].unwrap_or(NEVER);
            assigned[robot].push(TaskId(tasks[task] as u32));
        }
    };
    for coalition in coalitions {
        let tasks: Vec<usize> = coalition.iter().map(|task| task.index()).collect();
        assign_at_once(&mut assigned, &tasks);
    }
    let can_be_done = |task: &usize| cost_ms.iter().any(|row| row[*task].is_some());
    let mut left: Vec<usize> = (0..tasks).filter(can_be_done).collect();
    left.retain(|task| {
        !coalitions
            .iter()
            .flatten()
            .any(|of_coalition| of_coalition.index() == *task)
    });
    while !left.is_empty() {
        assign_at_once(&mut assigned, &left);
        left.retain(|task| {
            !assigned
                .iter()
                .flatten()
                .any(|task_id| task_id.index() == *task)
        });
    }
    assigned.into_iter().map(Arc::from).collect()
}

/// Returns a maximum number of pairs of rows and columns with the least total cost.
pub(crate) fn least_cost(
    rows: usize,
    columns: usize,
    cost: &dyn Fn(usize, usize) -> i64,
) -> Vec<(usize, usize)> {
    // The method requires at most as many rows as columns.
    if rows > columns {
        let pairs = least_cost(columns, rows, &|row, column| cost(column, row));
        return pairs
            .into_iter()
            .map(|(row, column)| (column, row))
            .collect();
    }
    let costs = Matrix::from_fn(rows, columns, |(row, column)| cost(row, column));
    let (_, columns_of_rows) = kuhn_munkres_min(&costs);
    columns_of_rows.into_iter().enumerate().collect()
}

/// Returns the tasks of one robot; none without an assignment.
#[must_use]
pub fn tasks_of(assignment: &[Arc<[TaskId]>], robot: RobotId) -> Arc<[TaskId]> {
    assignment.get(robot.index()).cloned().unwrap_or_default()
}
