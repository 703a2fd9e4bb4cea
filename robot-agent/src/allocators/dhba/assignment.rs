//! The part of the team's assignment that concerns one robot.
//!
//! Two robots compete if they have entries for the same task. The assignment of a group of robots without competitors
//! outside of the group does not depend on the other rows, except for the scale of the values. A robot therefore
//! solves the problem of the group that competes for its own tasks, and only if that problem has changed.

use proto::allocation::ble::EligibleTask;
use proto::tick::TaskOffer;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::matrix::Matrix;
use crate::allocator::{SelfState, TaskBrief};
use crate::allocators::oracle::plan::{Plan, Scale};

#[derive(Clone, Debug)]
pub struct Assignment {
    /// The tasks for which the robot has a behavior.
    own_tasks: Vec<TaskId>,
    plan: Plan,
    /// The latest solved problem.
    problem: Problem,
    /// Memory for the next problem.
    next: Problem,
    /// The structure of the matrix to which the following values belong: [`Matrix::structure`].
    structure: Option<u64>,
    /// The scale of all offers. Its largest utility can be out of date.
    scale: Scale,
    /// The latest round of each task in the matrix.
    rounds: Vec<SimTime>,
    /// For each task, another task of the same group, or itself: a disjoint-set forest.
    linked: Vec<u32>,
    /// True if an entry of the matrix is void.
    has_void: bool,
    /// True for the tasks of the group.
    is_of_group: Vec<bool>,
    /// The places of the rows with entries for tasks of the group.
    group: Vec<usize>,
    /// The robots of the group with a task in the solution, and their tasks.
    assigned: Vec<(RobotId, TaskId)>,
    /// For each task, the robot in `assigned` that has it; of several, the one of lowest rank.
    holders: Vec<Option<RobotId>>,
}

/// The offers of the robot's group, and the scale of all offers.
#[derive(Clone, Debug, Default, PartialEq)]
struct Problem {
    offers: Vec<TaskOffer>,
    scale: Scale,
}

impl Assignment {
    pub fn new(me: &SelfState) -> Self {
        Self {
            own_tasks: me.behaviors.iter().map(|own| own.task).collect(),
            plan: Plan::default(),
            problem: Problem::default(),
            next: Problem::default(),
            structure: None,
            scale: Scale::default(),
            rounds: vec![SimTime::ZERO; me.tasks],
            linked: Vec::new(),
            has_void: false,
            is_of_group: vec![false; me.tasks],
            group: Vec::new(),
            assigned: Vec::new(),
            holders: vec![None; me.tasks],
        }
    }

    /// Returns whether the problem can change if a teammate's row changes from `old` to `new`. Most rows of a large team
    /// have no effect on it.
    pub fn depends_on(
        &self,
        old: &[EligibleTask],
        new: &[EligibleTask],
        briefs: &[TaskBrief],
    ) -> bool {
        let scale = &self.problem.scale;
        let is_foreign =
            |entry: &EligibleTask| !self.has_void && !self.is_of_group[entry.task.index()];
        let can_go = |entry: &EligibleTask| scale.is_same_without(f64::from(entry.utility));
        let can_come = |entry: &EligibleTask| {
            let at = entry.task.index();
            let priority = briefs.get(at).map(|brief| brief.priority);
            entry.round == self.rounds[at]
                && priority
                    .is_some_and(|priority| scale.is_same_with(f64::from(entry.utility), priority))
        };
        !old.iter().all(|entry| is_foreign(entry) && can_go(entry))
            || !new.iter().all(|entry| is_foreign(entry) && can_come(entry))
    }

    /// Solves the assignment problem of the matrix. Entries of an older round are void.
    pub fn update(&mut self, matrix: &Matrix, briefs: &[TaskBrief]) {
        if self.structure != Some(matrix.structure()) {
            self.structure = Some(matrix.structure());
            self.find_group(matrix);
            self.find_scale(matrix, briefs);
        }
        let mut offers = std::mem::take(&mut self.next.offers);
        offers.clear();
        for &place in &self.group {
            let (robot, entries) = matrix.row(place);
            let valid = entries.iter().filter(|entry| self.is_valid(entry));
            offers.extend(valid.map(|entry| offer(robot, entry)));
        }
        let largest = if self.has_void {
            let entries = matrix.rows().flat_map(|(_, entries)| entries);
            let valid = entries.filter(|entry| self.is_valid(entry));
            valid.fold(0.0, |largest, entry| entry.utility.max(largest))
        } else {
            matrix.largest()
        };
        self.next = Problem {
            offers,
            scale: self.scale.with_largest(f64::from(largest)),
        };
        if self.next == self.problem {
            return;
        }
        std::mem::swap(&mut self.next, &mut self.problem);
        let Problem { offers, scale } = &self.problem;
        self.plan.compute_part(offers, scale, briefs);
        let assigned = self.plan.assigned(offers);
        for (_, task) in self.assigned.drain(..) {
            self.holders[task.index()] = None;
        }
        for offer in assigned {
            self.assigned.push((offer.robot, offer.task));
            self.holders[offer.task.index()].get_or_insert(offer.robot);
        }
    }

    /// Returns the holder of a task of the group; of several, the one of lowest rank.
    pub fn holder(&self, task: TaskId) -> Option<RobotId> {
        self.holders[task.index()]
    }

    /// Returns the robots of the group with a task, and their tasks, by rank.
    pub fn assigned(&self) -> &[(RobotId, TaskId)] {
        &self.assigned
    }

    /// Returns whether an entry is not of an older round.
    fn is_valid(&self, entry: &EligibleTask) -> bool {
        entry.round == self.rounds[entry.task.index()]
    }

    /// Finds void entries and the scale of the others.
    fn find_scale(&mut self, matrix: &Matrix, briefs: &[TaskBrief]) {
        let mut scale = Scale::default();
        self.has_void = false;
        for (robot, entries) in matrix.rows() {
            for entry in entries {
                if self.is_valid(entry) {
                    scale.add(&offer(robot, entry), briefs);
                } else {
                    self.has_void = true;
                }
            }
        }
        scale.sort();
        self.scale = scale;
    }

    /// Marks the tasks of the group: those of the robot, and all others of robots that have an entry for one of the group.
    /// Also finds the latest rounds.
    fn find_group(&mut self, matrix: &Matrix) {
        self.rounds.fill(SimTime::ZERO);
        self.linked.clear();
        self.linked.extend((0..).take(self.rounds.len()));
        for (_, entries) in matrix.rows() {
            let mut first = None;
            for entry in entries {
                let at = entry.task.index();
                self.rounds[at] = entry.round.max(self.rounds[at]);
                let root = root(&mut self.linked, at);
                self.linked[root] = *first.get_or_insert(root as u32);
            }
        }
        self.is_of_group.fill(false);
        for task in &self.own_tasks {
            self.is_of_group[root(&mut self.linked, task.index())] = true;
        }
        for task in 0..self.linked.len() {
            let root = root(&mut self.linked, task);
            self.is_of_group[task] = self.is_of_group[root];
        }
        // All entries of a row are for tasks of one group.
        let is_of_group = |entries: &[EligibleTask]| {
            let first = entries.first();
            first.is_some_and(|entry| self.is_of_group[entry.task.index()])
        };
        let rows = matrix.rows().enumerate();
        let group = rows.filter(|(_, (_, entries))| is_of_group(entries));
        self.group.clear();
        self.group.extend(group.map(|(place, _)| place));
    }
}

fn offer(robot: RobotId, entry: &EligibleTask) -> TaskOffer {
    TaskOffer {
        robot,
        // The plan does not depend on the behavior.
        behavior: BehaviorId(0),
        task: entry.task,
        utility: f64::from(entry.utility),
    }
}

/// Returns the root of a task's set, and shortens the way to it.
fn root(linked: &mut [u32], mut task: usize) -> usize {
    while linked[task] as usize != task {
        let next = linked[task] as usize;
        linked[task] = linked[next];
        task = next;
    }
    task
}
