//! Ground truth for allocators that request it: the offers of all working robots in the previous tick.

use std::collections::BTreeMap;

use proto::telemetry::AllocationRow;
use proto::tick::TaskOffer;
use scenario::Setup;
use scenario::ids::{RobotId, TaskId};

use super::Simulation;
use crate::barrier::Presence;

#[derive(Clone, Default)]
pub(super) struct GroundTruth {
    /// The receivers, ordered by rank, with the number of the group.
    receivers: Vec<(RobotId, usize)>,
    /// The offers of the current tick, by group. Robots of a group share tasks, directly or through other robots.
    offers: Vec<Vec<TaskOffer>>,
}

impl GroundTruth {
    /// Writes the offers for a robot in the current tick.
    #[inline]
    pub(super) fn write_offers(&self, robot: RobotId, offers: &mut Vec<TaskOffer>) {
        // Most runs have no such allocator.
        if self.receivers.is_empty() {
            return;
        }
        if let Ok(place) = self
            .receivers
            .binary_search_by_key(&robot, |receiver| receiver.0)
        {
            offers.clone_from(&self.offers[self.receivers[place].1]);
        }
    }
}

/// Returns the group of each robot.
fn groups(robots: &[RobotId], setup: &Setup) -> Vec<usize> {
    let catalog = &setup.catalog;
    let tasks_of = |robot: &RobotId| {
        let behaviors = catalog.behaviors_of(&setup.scenario.robots[robot.index()]);
        behaviors.map(|behavior| catalog.sets[behavior.index()].task)
    };
    let mut groups: Vec<usize> = (0..robots.len()).collect();
    let mut of_task: BTreeMap<TaskId, usize> = BTreeMap::new();
    for (place, robot) in robots.iter().enumerate() {
        for task in tasks_of(robot) {
            let (group, other) = (groups[place], *of_task.entry(task).or_insert(place));
            let other = groups[other];
            // The shared task joins the two groups.
            groups
                .iter_mut()
                .filter(|member| **member == other)
                .for_each(|member| *member = group);
        }
    }
    groups
}

impl Simulation {
    /// Sends the ground truth to these robots from now on.
    pub fn send_ground_truth_to(&mut self, mut robots: Vec<RobotId>) {
        robots.sort_unstable();
        let groups = groups(&robots, &self.setup);
        self.ground_truth.offers = vec![Vec::new(); robots.len()];
        self.ground_truth.receivers = robots.into_iter().zip(groups).collect();
    }

    /// Computes the ground truth of the tick that is about to start.
    pub(super) fn compute_ground_truth(&mut self) {
        if self.ground_truth.receivers.is_empty() {
            return;
        }
        let mission = self.world.mission();
        let mut offers = std::mem::take(&mut self.ground_truth.offers);
        offers.iter_mut().for_each(Vec::clear);
        for &(robot, group) in self
            .ground_truth
            .receivers
            .iter()
            .filter(|receiver| self.can_work(receiver.0))
        {
            let rows = self.answers.report(robot).allocation.iter();
            let is_due = |row: &AllocationRow| mission.has_work(row.task, robot, &self.world);
            let rows = rows.filter(|row| row.utility > 0.0 && is_due(row));
            offers[group].extend(rows.map(|row| TaskOffer {
                robot,
                behavior: row.behavior,
                task: row.task,
                utility: row.utility,
            }));
        }
        self.ground_truth.offers = offers;
    }

    /// Checks whether a robot took part in the previous tick, still does, and has a working body.
    fn can_work(&self, robot: RobotId) -> bool {
        let answer = &self.answers.all()[robot.index()];
        answer.counts
            && self.barrier.presence(robot) == Presence::Present
            && self.barrier.incarnation(robot) == Some(answer.report.incarnation)
            && self.actuators.can_execute(robot)
            && self.world.energy_j(robot).is_none_or(|left_j| left_j > 0.0)
    }
}
