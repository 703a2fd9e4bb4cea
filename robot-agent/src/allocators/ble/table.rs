//! The eligibility of each robot for each task, and the assignment computed from it.

use std::cmp::Reverse;

use proto::allocation::ble::EligibleTask;
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use crate::allocator::TaskBrief;
use crate::allocator::utility::Bid;
use crate::by_rank::ByRank;

/// The incarnation and sequence number of a message.
pub type MessageNumber = (Incarnation, u64);

#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: ByRank<Row>,
    /// The assigned pairs, the best first.
    assigned: Vec<(RobotId, TaskId)>,
    scratch: Scratch,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Update {
    pub changed: bool,
    /// True if the table had no row of the sender before.
    pub is_newcomer: bool,
}

/// The last broadcast of a robot. An expired row stays without entries, so that older messages are still rejected.
#[derive(Clone, Debug, Default)]
struct Row {
    stamp: MessageNumber,
    /// The receive time; `None` once the row has expired.
    received: Option<SimTime>,
    entries: SmallVec<[EligibleTask; 6]>,
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    pairs: Vec<Pair>,
    tasks: Vec<Task>,
    is_struck: Vec<bool>,
}

/// An eligible pair of a robot and a task, with the indices of both.
#[derive(Clone, Copy, Debug)]
struct Pair {
    bid: Bid,
    row: usize,
    task: usize,
}

/// A task for which at least one robot is eligible.
#[derive(Clone, Copy, Debug)]
struct Task {
    id: TaskId,
    round: SimTime,
    free: usize,
}

impl Table {
    /// Stores a row if its message is newer than the last one.
    pub fn receive(
        &mut self,
        robot: RobotId,
        stamp: MessageNumber,
        entries: impl Iterator<Item = EligibleTask> + Clone,
        now: SimTime,
    ) -> Update {
        let row = self.rows.get_or_insert_with(robot, Row::default);
        if stamp <= row.stamp {
            return Update::default();
        }
        let newcomer = row.received.is_none() || stamp.0 > row.stamp.0;
        (row.stamp, row.received) = (stamp, Some(now));
        Update {
            changed: set(&mut row.entries, entries),
            is_newcomer: newcomer,
        }
    }

    /// Replaces the row of the robot that owns the table.
    pub fn set_row_of(&mut self, me: RobotId, entries: impl Iterator<Item = EligibleTask> + Clone) {
        let row = self.rows.get_or_insert_with(me, Row::default);
        set(&mut row.entries, entries);
    }

    pub fn row(&self, robot: RobotId) -> &[EligibleTask] {
        match self.rows.place(robot) {
            Ok(place) => &self.rows.at(place).entries,
            Err(_) => &[],
        }
    }

    /// Drops the rows received up to `than`, except that of `me`. Returns whether there were any, and the oldest
    /// remaining receive time.
    pub fn drop_older(&mut self, than: SimTime, me: RobotId) -> (bool, Option<SimTime>) {
        let own = self.rows.place(me).ok();
        let (mut dropped, mut oldest) = (false, None);
        for (place, row) in self.rows.values_mut().enumerate() {
            let Some(received) = row.received.filter(|_| Some(place) != own) else {
                continue;
            };
            if received <= than {
                row.received = None;
                row.entries.clear();
                dropped = true;
            } else {
                oldest = Some(oldest.map_or(received, |other: SimTime| other.min(received)));
            }
        }
        (dropped, oldest)
    }

    /// Computes the greedy assignment: takes the best pair of a robot and a task, removes both, and repeats, within
    /// each task's limit. Entries of an older round are void.
    pub fn assign(&mut self, briefs: &[TaskBrief]) {
        let Scratch {
            pairs,
            tasks,
            is_struck,
        } = &mut self.scratch;
        for (_, row) in self.rows.iter() {
            tasks.extend(row.entries.iter().map(|entry| Task {
                id: entry.task,
                round: entry.round,
                free: briefs[entry.task.index()].max_robots,
            }));
        }
        tasks.sort_unstable_by_key(|task| (task.id, Reverse(task.round)));
        tasks.dedup_by_key(|task| task.id);
        for (row, (robot, own)) in self.rows.iter().enumerate() {
            for entry in &own.entries {
                let place = tasks.binary_search_by_key(&entry.task, |task| task.id);
                let Ok(task) = place else { continue };
                if tasks[task].round == entry.round {
                    let bid = Bid {
                        priority: briefs[entry.task.index()].priority,
                        utility: f64::from(entry.utility),
                        robot,
                        task: entry.task,
                    };
                    pairs.push(Pair { bid, row, task });
                }
            }
            is_struck.push(false);
        }
        pairs.sort_unstable_by(|one, other| other.bid.order(&one.bid));
        self.assigned.clear();
        for pair in &*pairs {
            let free = &mut tasks[pair.task].free;
            if *free > 0 && !is_struck[pair.row] {
                *free -= 1;
                is_struck[pair.row] = true;
                self.assigned.push((pair.bid.robot, pair.bid.task));
            }
        }
        pairs.clear();
        tasks.clear();
        is_struck.clear();
    }

    pub fn task_of(&self, robot: RobotId) -> Option<TaskId> {
        let mut all = self.assigned.iter();
        all.find(|(assigned, _)| *assigned == robot)
            .map(|&(_, task)| task)
    }

    /// Returns the best robot assigned to the task in the latest assignment.
    pub fn holder_of(&self, task: TaskId) -> Option<RobotId> {
        let mut all = self.assigned.iter();
        all.find(|(_, assigned)| *assigned == task)
            .map(|&(robot, _)| robot)
    }
}

/// Replaces the entries. Returns whether they changed.
fn set(
    known: &mut SmallVec<[EligibleTask; 6]>,
    entries: impl Iterator<Item = EligibleTask> + Clone,
) -> bool {
    if entries.clone().eq(known.iter().copied()) {
        return false;
    }
    known.clear();
    known.extend(entries);
    true
}
