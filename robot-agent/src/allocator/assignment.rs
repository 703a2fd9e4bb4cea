//! Tasks that are given to robots before the start, for allocators that [want](super::Allocator::wants_assignment) it: the Hungarian
//! method on the cost of each task for each robot, repeated with the loads of the rounds before added, until all tasks are given.

use std::sync::Arc;

use alliance_proto::ids::{RobotId, TaskId};
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// A cost in ms that no sum of real ones reaches: the robot cannot do the task.
const NEVER: i64 = 1 << 40;

/// Gives every task that anybody can do to one robot. `cost_ms` has a row per robot and a column per task, `None` where it cannot do
/// it. Returns the tasks of each robot, by rank.
#[must_use]
pub fn assign(cost_ms: &[Vec<Option<i64>>]) -> Vec<Arc<[TaskId]>> {
    let tasks = cost_ms.first().map_or(0, Vec::len);
    let mut given: Vec<Vec<TaskId>> = vec![Vec::new(); cost_ms.len()];
    let mut load_ms = vec![0; cost_ms.len()];
    let can_be_done = |task: &usize| cost_ms.iter().any(|row| row[*task].is_some());
    let mut left: Vec<usize> = (0..tasks).filter(can_be_done).collect();
    while !left.is_empty() {
        let cost = |robot: usize, task: usize| match cost_ms[robot][left[task]] {
            Some(cost_ms) => load_ms[robot] + cost_ms,
            None => NEVER,
        };
        // The method wants no more rows than columns.
        let wide = cost_ms.len() <= left.len();
        let (rows, columns) = if wide {
            (cost_ms.len(), left.len())
        } else {
            (left.len(), cost_ms.len())
        };
        let of = |(row, column): (usize, usize)| {
            if wide {
                cost(row, column)
            } else {
                cost(column, row)
            }
        };
        let (_, columns_of_rows) = kuhn_munkres_min(&Matrix::from_fn(rows, columns, of));
        let pairs = columns_of_rows.into_iter().enumerate();
        let pairs: Vec<(usize, usize)> = pairs
            .map(|(row, column)| if wide { (row, column) } else { (column, row) })
            .filter(|&(robot, task)| cost_ms[robot][left[task]].is_some())
            .collect();
        for &(robot, task) in &pairs {
            load_ms[robot] += cost_ms[robot][left[task]].unwrap_or(NEVER);
            given[robot].push(TaskId(left[task] as u16));
        }
        left.retain(|task| !given.iter().flatten().any(|it| it.index() == *task));
    }
    given.into_iter().map(Arc::from).collect()
}

/// The tasks of one robot in such an assignment.
#[must_use]
pub fn of(assignment: &[Arc<[TaskId]>], robot: RobotId) -> Arc<[TaskId]> {
    assignment.get(robot.index()).cloned().unwrap_or_default()
}
