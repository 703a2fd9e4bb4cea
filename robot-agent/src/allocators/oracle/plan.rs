//! The assignment of most worth: each robot has one of its offers or none, no task more robots than it may have. By shortest augmenting
//! paths, one robot after the other (the Hungarian method, Kuhn 1955, on what is on offer alone).

use alliance_proto::tick::Offer;
use smallvec::SmallVec;

use crate::allocator::TaskBrief;

/// Utilities are compared as whole shares of the largest of them.
const SHARES: f64 = (1 << 30) as f64;

/// Distance of a task that the search has not reached.
const FAR: i64 = i64::MAX;

/// A plan, with the memory in which it was made.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    robots: Vec<Robot>,
    tasks: Vec<Task>,
    /// Worth of each offer.
    worth: Vec<i64>,
    /// Priorities that are on offer, in order.
    priorities: SmallVec<[i32; 4]>,
    /// Robots that the search has reached, with their distances.
    seen: Vec<(usize, i64)>,
    /// Tasks that the search has reached.
    touched: Vec<usize>,
}

/// A robot with its offers, which are next to each other.
#[derive(Clone, Debug)]
struct Robot {
    from: usize,
    to: usize,
    /// The offer that it is assigned.
    has: Option<usize>,
    /// Its dual variable: no less than the worth of any of its offers without the task's price, and exactly that of the one that it is assigned.
    gain: i64,
}

#[derive(Clone, Debug, Default)]
struct Task {
    /// Robots that it is assigned to.
    holders: SmallVec<[usize; 2]>,
    /// Its dual variable, 0 while it has a place left.
    price: i64,
    /// Distance of the task from where the search began.
    at: i64,
    /// Whether the search has gone on from this task.
    is_left: bool,
    /// The robot and its offer by which the search reached this task.
    by: (usize, usize),
}

/// Where an augmenting path ends.
enum End {
    /// At a robot that is left without a task.
    Leaves(usize),
    /// At a task with a place left.
    Place(usize),
}

impl Plan {
    /// Makes the plan of most worth: the most of the higher priorities, then the largest sum of utilities. Offers are in the order of
    /// robots.
    pub fn make(&mut self, offers: &[Offer], briefs: &[TaskBrief]) {
        self.weigh(offers, briefs);
        self.tasks.resize_with(briefs.len(), Task::default);
        for task in &mut self.tasks {
            task.holders.clear();
            (task.price, task.at, task.is_left) = (0, FAR, false);
        }
        self.robots.clear();
        let mut from = 0;
        for own in offers.chunk_by(|a, b| a.robot == b.robot) {
            self.robots.push(Robot {
                from,
                to: from + own.len(),
                has: None,
                gain: 0,
            });
            from += own.len();
            self.join(self.robots.len() - 1, offers, briefs);
        }
    }

    /// The offers that are taken, in the order of robots.
    pub fn taken<'a>(&'a self, offers: &'a [Offer]) -> impl Iterator<Item = &'a Offer> {
        let taken = self.robots.iter().filter_map(|robot| robot.has);
        taken.map(|offer| &offers[offer])
    }

    /// What each offer is worth; 0 for a task that there is not.
    fn weigh(&mut self, offers: &[Offer], briefs: &[TaskBrief]) {
        let brief = |offer: &Offer| briefs.get(offer.task.index());
        self.priorities.clear();
        let mut largest = 0.0_f64;
        for offer in offers {
            largest = largest.max(offer.utility);
            if let Some(brief) = brief(offer)
                && !self.priorities.contains(&brief.priority)
            {
                self.priorities.push(brief.priority);
            }
        }
        self.priorities.sort_unstable();
        let worth = |offer| {
            let Some(TaskBrief { priority, .. }) = brief(offer) else {
                return 0;
            };
            // One step of priority is worth more than all utilities together, and any work more than none.
            let rank = self.priorities.partition_point(|it| it < priority) as i64;
            let shares = (offer.utility / largest * SHARES) as i64;
            rank * SHARES as i64 * (offers.len() as i64 + 1) + shares.max(1)
        };
        self.worth.clear();
        self.worth.extend(offers.iter().map(worth));
    }

    /// One robot more: it takes what is best, and whoever had that something else, along the way on which the least is lost.
    fn join(&mut self, robot: usize, offers: &[Offer], briefs: &[TaskBrief]) {
        let Robot { from, to, .. } = self.robots[robot];
        let gain = |offer: usize| {
            let task = self.tasks.get(offers[offer].task.index());
            task.map_or(0, |task| self.worth[offer] - task.price)
        };
        let gain = (from..to).map(gain).max().unwrap_or(0).max(0);
        self.robots[robot].gain = gain;
        self.seen.clear();
        self.touched.clear();
        let (mut end, mut loss) = (End::Leaves(robot), gain);
        self.look(robot, 0, loss, offers);
        while let Some(task) = self.nearest(loss) {
            self.tasks[task].is_left = true;
            let Task {
                at, ref holders, ..
            } = self.tasks[task];
            if holders.len() < briefs[task].max_robots {
                (end, loss) = (End::Place(task), at);
                break;
            }
            for holder in holders.clone() {
                let leaves = at + self.robots[holder].gain;
                // Of two with the same claim the lower rank keeps it.
                let is_later = matches!(end, End::Leaves(other) if holder > other);
                if leaves < loss || (leaves == loss && is_later) {
                    (end, loss) = (End::Leaves(holder), leaves);
                }
                self.look(holder, at, loss, offers);
            }
        }
        for &(robot, at) in &self.seen {
            self.robots[robot].gain -= (loss - at).max(0);
        }
        let mut free = match end {
            End::Leaves(robot) => self.release(robot, offers),
            End::Place(task) => Some(task),
        };
        while let Some(task) = free {
            let (robot, offer) = self.tasks[task].by;
            free = self.release(robot, offers);
            self.robots[robot].has = Some(offer);
            self.tasks[task].holders.push(robot);
        }
        for &task in &self.touched {
            let task = &mut self.tasks[task];
            task.price += (loss - task.at).max(0);
            (task.at, task.is_left) = (FAR, false);
        }
    }

    /// The search reaches a robot, and from it the tasks that are nearer than `loss`.
    fn look(&mut self, robot: usize, at: i64, loss: i64, offers: &[Offer]) {
        self.seen.push((robot, at));
        let Robot { from, to, gain, .. } = self.robots[robot];
        for (offer, it) in (from..to).zip(&offers[from..to]) {
            let number = it.task.index();
            let Some(task) = self.tasks.get_mut(number) else {
                continue;
            };
            let far = at + gain + task.price - self.worth[offer];
            if far < task.at && far < loss {
                if task.at == FAR {
                    self.touched.push(number);
                }
                (task.at, task.by) = (far, (robot, offer));
            }
        }
    }

    /// The nearest task from which the search has not gone on, if it is nearer than `loss`.
    fn nearest(&self, loss: i64) -> Option<usize> {
        let left = self.touched.iter().map(|&it| (self.tasks[it].at, it));
        let left = left.filter(|&(at, it)| at < loss && !self.tasks[it].is_left);
        left.min().map(|(_, it)| it)
    }

    /// Takes a robot's task away from it; returns that task.
    fn release(&mut self, robot: usize, offers: &[Offer]) -> Option<usize> {
        let offer = self.robots[robot].has.take()?;
        let task = offers[offer].task.index();
        self.tasks[task].holders.retain(|it| *it != robot);
        Some(task)
    }
}
