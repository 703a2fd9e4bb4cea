//! The assignment with the largest total value, by shortest augmenting paths (the Hungarian method, Kuhn 1955,
//! restricted to the existing offers).

use proto::tick::TaskOffer;
use smallvec::SmallVec;

use crate::allocator::TaskBrief;

/// The number of integer units into which the largest utility is divided for comparison.
const SHARES: f64 = (1 << 30) as f64;

const UNREACHED: i64 = i64::MAX;

#[derive(Clone, Debug, Default)]
pub(in crate::allocators) struct Plan {
    robots: Vec<Robot>,
    tasks: Vec<Task>,
    worth: Vec<i64>,
    scale: Scale,
    seen: Vec<(usize, i64)>,
    touched: Vec<usize>,
}

/// The scale on which offers are compared. It depends on all offers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::allocators) struct Scale {
    largest: f64,
    offers: usize,
    /// The priorities of the offered tasks, in ascending order.
    priorities: SmallVec<[i32; 4]>,
}

impl Scale {
    pub fn clear(&mut self) {
        (self.largest, self.offers) = (0.0, 0);
        self.priorities.clear();
    }

    /// Adds an offer. [`Scale::sort`] must follow the last one.
    pub fn add(&mut self, offer: &TaskOffer, briefs: &[TaskBrief]) {
        self.largest = self.largest.max(offer.utility);
        self.offers += 1;
        if let Some(brief) = briefs.get(offer.task.index())
            && !self.priorities.contains(&brief.priority)
        {
            self.priorities.push(brief.priority);
        }
    }

    /// Returns whether an offer of the utility `old` can be removed without a change of the scale, apart from the number of
    /// offers, which has no effect on offers of one priority.
    pub fn is_same_without(&self, old: f64) -> bool {
        self.priorities.len() == 1 && old < self.largest
    }

    /// Returns whether an offer can be added without a change of the scale, apart from the number of offers, which has no
    /// effect on offers of one priority.
    pub fn is_same_with(&self, new: f64, priority: i32) -> bool {
        self.priorities[..] == [priority] && new <= self.largest
    }

    /// Returns the scale with another largest utility.
    pub fn with_largest(&self, largest: f64) -> Self {
        Self {
            largest,
            ..self.clone()
        }
    }

    pub fn sort(&mut self) {
        self.priorities.sort_unstable();
    }

    /// Returns the value of an offer; 0 for an unknown task.
    fn worth(&self, offer: &TaskOffer, briefs: &[TaskBrief]) -> i64 {
        let Some(TaskBrief { priority, .. }) = briefs.get(offer.task.index()) else {
            return 0;
        };
        // One priority level outweighs all utilities together, and any work outweighs none.
        let rank = self.priorities.partition_point(|lower| lower < priority) as i64;
        let shares = (offer.utility / self.largest * SHARES) as i64;
        rank * SHARES as i64 * (self.offers as i64 + 1) + shares.max(1)
    }
}

/// A robot and the range of its offers.
#[derive(Clone, Debug)]
struct Robot {
    from: usize,
    to: usize,
    /// The index of the assigned offer.
    assigned: Option<usize>,
    /// The dual variable of the robot: at least the value of each offer minus the task's price, with equality for the
    /// assigned offer.
    gain: i64,
}

#[derive(Clone, Debug, Default)]
struct Task {
    holders: SmallVec<[usize; 2]>,
    /// The dual variable of the task; 0 while it has a free place.
    price: i64,
    /// The distance from the start of the search.
    at: i64,
    is_visited: bool,
    /// The robot and the offer from which the search reached this task.
    by: (usize, usize),
}

/// The end of an augmenting path.
enum End {
    /// A robot that loses its task.
    Leaves(usize),
    /// A task with a free place.
    Place(usize),
}

impl Plan {
    /// Computes the best plan: first by the higher priorities, then by the sum of utilities. The offers are sorted by
    /// robot.
    pub fn compute(&mut self, offers: &[TaskOffer], briefs: &[TaskBrief]) {
        let mut scale = std::mem::take(&mut self.scale);
        scale.clear();
        for offer in offers {
            scale.add(offer, briefs);
        }
        scale.sort();
        self.compute_part(offers, &scale, briefs);
        self.scale = scale;
    }

    /// Computes the part of the plan of all offers that consists of `offers`. No other offer is for a task or from a robot
    /// of the part. `scale` is that of all offers.
    pub fn compute_part(&mut self, offers: &[TaskOffer], scale: &Scale, briefs: &[TaskBrief]) {
        self.worth.clear();
        let worth = offers.iter().map(|offer| scale.worth(offer, briefs));
        self.worth.extend(worth);
        self.tasks.resize_with(briefs.len(), Task::default);
        for task in &mut self.tasks {
            task.holders.clear();
            (task.price, task.at, task.is_visited) = (0, UNREACHED, false);
        }
        self.robots.clear();
        let mut from = 0;
        for group in offers.chunk_by(|a, b| a.robot == b.robot) {
            self.robots.push(Robot {
                from,
                to: from + group.len(),
                assigned: None,
                gain: 0,
            });
            from += group.len();
            self.join(self.robots.len() - 1, offers, briefs);
        }
    }

    pub fn assigned<'a>(&'a self, offers: &'a [TaskOffer]) -> impl Iterator<Item = &'a TaskOffer> {
        let taken = self.robots.iter().filter_map(|robot| robot.assigned);
        taken.map(|offer| &offers[offer])
    }

    /// Adds one robot. It takes its best task, and displaced robots change tasks along the path with the least loss.
    fn join(&mut self, robot: usize, offers: &[TaskOffer], briefs: &[TaskBrief]) {
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
            self.tasks[task].is_visited = true;
            let Task {
                at, ref holders, ..
            } = self.tasks[task];
            if holders.len() < briefs[task].max_robots {
                (end, loss) = (End::Place(task), at);
                break;
            }
            for holder in holders.clone() {
                let leaves = at + self.robots[holder].gain;
                // Of two equal claims the lower rank keeps the task.
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
            self.robots[robot].assigned = Some(offer);
            self.tasks[task].holders.push(robot);
        }
        for &task in &self.touched {
            let task = &mut self.tasks[task];
            task.price += (loss - task.at).max(0);
            (task.at, task.is_visited) = (UNREACHED, false);
        }
    }

    /// Adds a robot to the search, and its tasks that are nearer than `loss`.
    fn look(&mut self, robot: usize, at: i64, loss: i64, offers: &[TaskOffer]) {
        self.seen.push((robot, at));
        let Robot { from, to, gain, .. } = self.robots[robot];
        for (index, offer) in (from..to).zip(&offers[from..to]) {
            let number = offer.task.index();
            let Some(task) = self.tasks.get_mut(number) else {
                continue;
            };
            let distance = at + gain + task.price - self.worth[index];
            if distance < task.at && distance < loss {
                if task.at == UNREACHED {
                    self.touched.push(number);
                }
                (task.at, task.by) = (distance, (robot, index));
            }
        }
    }

    /// Returns the nearest reached task without further search, if it is nearer than `loss`.
    fn nearest(&self, loss: i64) -> Option<usize> {
        let left = self.touched.iter().map(|&task| (self.tasks[task].at, task));
        let left = left.filter(|&(at, task)| at < loss && !self.tasks[task].is_visited);
        left.min().map(|(_, task)| task)
    }

    fn release(&mut self, robot: usize, offers: &[TaskOffer]) -> Option<usize> {
        let offer = self.robots[robot].assigned.take()?;
        let task = offers[offer].task.index();
        self.tasks[task].holders.retain(|holder| *holder != robot);
        Some(task)
    }
}
