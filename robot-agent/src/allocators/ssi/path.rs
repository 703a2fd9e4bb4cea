//! The path of a robot through its tasks, and the cost of one more task by cheapest insertion.

use scenario::ids::{BehaviorId, TaskId};
use serde::Deserialize;

/// The team objective, which decides the bids. RPC(r, S) is the cost of robot r's path through the tasks S: the time at
/// which the last of them is done, s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Objective {
    /// MiniSum: the sum of the path costs. The bid is RPC(r, S ∪ {t}) − RPC(r, S).
    #[serde(rename = "minisum")]
    Sum,
    /// MiniMax: the largest path cost. The bid is RPC(r, S ∪ {t}).
    #[serde(rename = "minimax")]
    Max,
    /// MiniAve: the mean time at which a task is done. The bid is the increase of the sum of these times.
    #[serde(rename = "miniave")]
    Mean,
}

/// A task on the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    pub task: TaskId,
    /// The task's priority; the path is in descending order of it.
    pub priority: i32,
    /// The index of the place in [`super::awards::Awards`].
    pub place: usize,
}

/// The robot's best behavior for a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offer {
    pub behavior: BehaviorId,
    pub reward: f64,
    /// The cost as the next task, s.
    pub cost_s: f64,
    /// The utility as the next task.
    pub utility: f64,
}

/// The time at which a path ends, and the sum of the times at which its tasks are done, both s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cost {
    end_s: f64,
    sum_s: f64,
}

impl Cost {
    fn of(self, objective: Objective) -> f64 {
        match objective {
            Objective::Sum | Objective::Max => self.end_s,
            Objective::Mean => self.sum_s,
        }
    }
}

/// The times of tasks: `seconds(after, task)` is the time for `task` after all tasks of `after`, s.
pub type Seconds<'a> = dyn Fn(&[TaskId], TaskId) -> Option<f64> + 'a;

#[derive(Clone, Debug, Default)]
pub struct Path {
    pub stops: Vec<Stop>,
}

/// The cheapest insertion of a task into a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Insertion {
    /// The index in the path.
    pub at: usize,
    /// The team cost by the objective, s; not negative.
    pub cost_s: f64,
}

impl Path {
    /// Returns the cheapest insertion of a task, the first of equal ones. The first `fixed` stops stay in front. `None`
    /// if the path is impossible with the task at every place.
    pub fn insertion(
        &self,
        objective: Objective,
        (task, priority): (TaskId, i32),
        fixed: usize,
        seconds: &Seconds<'_>,
    ) -> Option<Insertion> {
        let earliest = self.stops.partition_point(|stop| stop.priority > priority);
        let latest = self.stops.partition_point(|stop| stop.priority >= priority);
        let earliest = earliest.max(fixed.min(self.stops.len()));
        let mut tasks: Vec<TaskId> = self.stops.iter().map(|stop| stop.task).collect();
        let without = extend(Cost::default(), &tasks, 0, seconds)?;
        let mut before = Cost::default();
        for at in 0..earliest {
            before = extend(before, &tasks[..=at], at, seconds)?;
        }
        tasks.insert(earliest, task);
        let mut best: Option<(usize, f64)> = None;
        for at in earliest..=latest.max(earliest) {
            if let Some(cost) = extend(before, &tasks, at, seconds) {
                let cost_s = cost.of(objective);
                if best.is_none_or(|(_, least_s)| cost_s < least_s) {
                    best = Some((at, cost_s));
                }
            }
            if at + 1 < tasks.len() {
                tasks.swap(at, at + 1);
                before = extend(before, &tasks[..=at], at, seconds)?;
            }
        }
        let (at, cost_s) = best?;
        let cost_s = match objective {
            Objective::Max => cost_s,
            Objective::Sum | Objective::Mean => cost_s - without.of(objective),
        };
        let cost_s = cost_s.max(0.0);
        Some(Insertion { at, cost_s })
    }

    /// Sorts the stops by priority.
    pub fn sort(&mut self) {
        self.stops
            .sort_by_key(|stop| std::cmp::Reverse(stop.priority));
    }

    /// Removes the stops that are impossible after the earlier ones, and returns them.
    pub fn remove_impossible(&mut self, seconds: &Seconds<'_>) -> Vec<Stop> {
        let mut after = Vec::with_capacity(self.stops.len());
        let mut removed = Vec::new();
        self.stops.retain(|stop| {
            let is_possible = seconds(&after, stop.task).is_some();
            if is_possible {
                after.push(stop.task);
            } else {
                removed.push(*stop);
            }
            is_possible
        });
        removed
    }
}

/// Returns the cost of a path whose first `count` tasks have the cost `before`; `None` if it is impossible.
fn extend(before: Cost, tasks: &[TaskId], count: usize, seconds: &Seconds<'_>) -> Option<Cost> {
    let mut cost = before;
    for at in count..tasks.len() {
        cost.end_s += seconds(&tasks[..at], tasks[at])?;
        cost.sum_s += cost.end_s;
    }
    Some(cost)
}
