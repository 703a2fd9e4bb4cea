//! Who is how eligible for what, as all robots know it, and the assignment that follows from it.

use std::cmp::Reverse;

use alliance_proto::allocation::ble::Eligible;
use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::time::SimTime;
use smallvec::SmallVec;

use crate::allocator::TaskBrief;
use crate::allocator::utility::Bid;
use crate::by_rank::ByRank;

/// Number of a word, by which a later one of the same robot is told: its incarnation, its sequence number.
pub type Word = (Incarnation, u64);

/// The latest word of each robot.
#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: ByRank<Row>,
    /// Who has which task, the best pair first.
    assigned: Vec<(RobotId, TaskId)>,
    /// Memory of [`Table::assign`], empty between calls of it.
    scratch: Scratch,
}

/// What came of a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct News {
    /// The table has changed.
    pub changed: bool,
    /// Nothing was known of its sender, or no more.
    pub newcomer: bool,
}

/// What a robot said last. It is kept when the robot has ceased, without entries, so that older words stay older.
#[derive(Clone, Debug, Default)]
struct Row {
    word: Word,
    /// `None` once it has ceased.
    heard: Option<SimTime>,
    entries: SmallVec<[Eligible; 6]>,
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    pairs: Vec<Pair>,
    tasks: Vec<Task>,
    is_struck: Vec<bool>,
}

/// A robot and a task that it is eligible for, with the places of both.
#[derive(Clone, Copy, Debug)]
struct Pair {
    bid: Bid,
    row: usize,
    task: usize,
}

/// A task that somebody is eligible for.
#[derive(Clone, Copy, Debug)]
struct Task {
    id: TaskId,
    round: SimTime,
    free: usize,
}

impl Table {
    /// Takes a word in, if it is a newer one.
    pub fn hear(
        &mut self,
        robot: RobotId,
        word: Word,
        entries: impl Iterator<Item = Eligible> + Clone,
        now: SimTime,
    ) -> News {
        let row = self.rows.get_or_insert_with(robot, Row::default);
        if word <= row.word {
            return News::default();
        }
        let newcomer = row.heard.is_none() || word.0 > row.word.0;
        (row.word, row.heard) = (word, Some(now));
        News {
            changed: set(&mut row.entries, entries),
            newcomer,
        }
    }

    /// Replaces the row of the robot whose table it is.
    pub fn set_own(&mut self, me: RobotId, entries: impl Iterator<Item = Eligible> + Clone) {
        let row = self.rows.get_or_insert_with(me, Row::default);
        set(&mut row.entries, entries);
    }

    /// The row of a robot.
    pub fn row(&self, robot: RobotId) -> &[Eligible] {
        match self.rows.place(robot) {
            Ok(place) => &self.rows.at(place).entries,
            Err(_) => &[],
        }
    }

    /// Drops the rows that were heard before that time, but for one's own. Says whether there were any, and when the oldest of the
    /// others was heard.
    pub fn drop_older(&mut self, than: SimTime, me: RobotId) -> (bool, Option<SimTime>) {
        let own = self.rows.place(me).ok();
        let (mut dropped, mut oldest) = (false, None);
        for (place, row) in self.rows.values_mut().enumerate() {
            let Some(heard) = row.heard.filter(|_| Some(place) != own) else {
                continue;
            };
            if heard <= than {
                row.heard = None;
                row.entries.clear();
                dropped = true;
            } else {
                oldest = Some(oldest.map_or(heard, |other: SimTime| other.min(heard)));
            }
        }
        (dropped, oldest)
    }

    /// The best pair of a robot and a task, then the best of all that are left when both are struck, and so on: a task is struck
    /// when all its places are taken. What was said about an older round of a task is void.
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
        for (row, (robot, said)) in self.rows.iter().enumerate() {
            for entry in &said.entries {
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

    /// The task of a robot in the latest assignment.
    pub fn task_of(&self, robot: RobotId) -> Option<TaskId> {
        let mut all = self.assigned.iter();
        all.find(|(who, _)| *who == robot).map(|&(_, task)| task)
    }

    /// The best robot that has the task in the latest assignment.
    pub fn holder_of(&self, task: TaskId) -> Option<RobotId> {
        let mut all = self.assigned.iter();
        all.find(|(_, what)| *what == task).map(|&(robot, _)| robot)
    }
}

/// Says whether they differ from what was there.
fn set(
    known: &mut SmallVec<[Eligible; 6]>,
    entries: impl Iterator<Item = Eligible> + Clone,
) -> bool {
    if entries.clone().eq(known.iter().copied()) {
        return false;
    }
    known.clear();
    known.extend(entries);
    true
}
