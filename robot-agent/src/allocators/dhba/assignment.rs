//! The part of the team's assignment that concerns one robot.
//!
//! Two robots compete if they have entries for the same task. The assignment of a group of robots without competitors
//! outside of the group does not depend on the other rows, except for the scale of the values. A robot therefore
//! solves the problem of the group that competes for its own tasks, and only if that problem has changed.

use proto::allocation::ble::EligibleTask;
use proto::tick::TaskOffer;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::matrix::{Matrix, Row};
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
    /// The latest round of each task in the matrix.
    rounds: Vec<SimTime>,
    /// True if an entry of the matrix is void.
    has_void: bool,
    /// True for the tasks of the group.
    is_of_group: Vec<bool>,
    /// The robots of the group with a task in the solution, and their tasks.
    assigned: Vec<(RobotId, TaskId)>,
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
            rounds: vec![SimTime::ZERO; me.tasks],
            has_void: false,
            is_of_group: vec![false; me.tasks],
            assigned: Vec::new(),
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
        self.find_group(matrix);
        self.rounds.fill(SimTime::ZERO);
        for (_, row) in matrix.rows() {
            for entry in &row.entries {
                let round = &mut self.rounds[entry.task.index()];
                *round = entry.round.max(*round);
            }
        }
        let Problem { offers, scale } = &mut self.next;
        offers.clear();
        scale.clear();
        self.has_void = false;
        for (robot, row) in matrix.rows() {
            for entry in &row.entries {
                if entry.round != self.rounds[entry.task.index()] {
                    self.has_void = true;
                    continue;
                }
                let offer = TaskOffer {
                    robot,
                    // The plan does not depend on the behavior.
                    behavior: BehaviorId(0),
                    task: entry.task,
                    utility: f64::from(entry.utility),
                };
                scale.add(&offer, briefs);
                if self.is_of_group[entry.task.index()] {
                    offers.push(offer);
                }
            }
        }
        scale.sort();
        if self.next == self.problem {
            return;
        }
        std::mem::swap(&mut self.next, &mut self.problem);
        let Problem { offers, scale } = &self.problem;
        self.plan.compute_part(offers, scale, briefs);
        let assigned = self.plan.assigned(offers);
        self.assigned.clear();
        self.assigned
            .extend(assigned.map(|offer| (offer.robot, offer.task)));
    }

    /// Returns the robots of the group with a task, and their tasks, by rank.
    pub fn assigned(&self) -> &[(RobotId, TaskId)] {
        &self.assigned
    }

    /// Marks the tasks of the group: those of the robot, and all others of robots that have an entry for one of the group.
    fn find_group(&mut self, matrix: &Matrix) {
        self.is_of_group.fill(false);
        for task in &self.own_tasks {
            self.is_of_group[task.index()] = true;
        }
        let mut has_grown = true;
        while has_grown {
            has_grown = false;
            for (_, Row { entries, .. }) in matrix.rows() {
                let is_of_group = |task: TaskId| self.is_of_group[task.index()];
                if entries.iter().any(|entry| is_of_group(entry.task))
                    && !entries.iter().all(|entry| is_of_group(entry.task))
                {
                    for entry in entries {
                        self.is_of_group[entry.task.index()] = true;
                    }
                    has_grown = true;
                }
            }
        }
    }
}
