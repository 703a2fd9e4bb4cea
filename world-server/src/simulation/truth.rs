//! What robots are told of the truth, of those whose allocators ask for it: what each of them that can work had to offer in the tick
//! before. Of the others nothing is worked out.

use std::collections::BTreeMap;

use alliance_proto::ids::{RobotId, TaskId};
use alliance_proto::scenario::Setup;
use alliance_proto::telemetry::AllocationRow;
use alliance_proto::tick::Offer;

use super::Simulation;
use crate::barrier::Presence;

/// Who is told, and what.
#[derive(Default)]
pub(super) struct Truth {
    /// By rank, with the number of the group.
    told: Vec<(RobotId, usize)>,
    /// Of the current tick, by group: of robots that share tasks, directly or through others. What one of them does best depends on no
    /// other robot.
    offers: Vec<Vec<Offer>>,
}

impl Truth {
    /// What a robot is told in the current tick.
    #[inline]
    pub(super) fn tell(&self, robot: RobotId, told: &mut Vec<Offer>) {
        // As in most runs.
        if self.told.is_empty() {
            return;
        }
        if let Ok(place) = self.told.binary_search_by_key(&robot, |it| it.0) {
            told.clone_from(&self.offers[self.told[place].1]);
        }
    }
}

/// The group of each of those robots.
fn groups(robots: &[RobotId], setup: &Setup) -> Vec<usize> {
    let catalog = &setup.catalog;
    let tasks_of = |robot: &RobotId| {
        let behaviors = catalog.behaviors_of(&setup.scenario.robots[robot.index()]);
        behaviors.map(|it| catalog.sets[it.index()].task)
    };
    let mut groups: Vec<usize> = (0..robots.len()).collect();
    let mut of_task: BTreeMap<TaskId, usize> = BTreeMap::new();
    for (place, robot) in robots.iter().enumerate() {
        for task in tasks_of(robot) {
            let (group, other) = (groups[place], *of_task.entry(task).or_insert(place));
            let other = groups[other];
            // The two are one.
            groups
                .iter_mut()
                .filter(|it| **it == other)
                .for_each(|it| *it = group);
        }
    }
    groups
}

impl Simulation {
    /// Tells these robots the truth from now on. Nothing changes for the others.
    pub fn tell_truth_to(&mut self, mut robots: Vec<RobotId>) {
        robots.sort_unstable();
        let groups = groups(&robots, &self.setup);
        self.truth.offers = vec![Vec::new(); robots.len()];
        self.truth.told = robots.into_iter().zip(groups).collect();
    }

    /// Works out the truth of the tick that is about to be asked for.
    pub(super) fn learn_truth(&mut self) {
        if self.truth.told.is_empty() {
            return;
        }
        let mission = self.world.mission();
        let mut offers = std::mem::take(&mut self.truth.offers);
        offers.iter_mut().for_each(Vec::clear);
        for &(robot, group) in self.truth.told.iter().filter(|it| self.can_work(it.0)) {
            let rows = self.answers.report(robot).allocation.iter();
            let is_due = |row: &AllocationRow| mission.is_due(row.task, robot, &self.world);
            let rows = rows.filter(|row| row.utility > 0.0 && is_due(row));
            offers[group].extend(rows.map(|row| Offer {
                robot,
                behavior: row.behavior,
                task: row.task,
                utility: row.utility,
            }));
        }
        self.truth.offers = offers;
    }

    /// Whether a robot took part in the tick before, still does, and its body obeys it.
    fn can_work(&self, robot: RobotId) -> bool {
        let answer = &self.answers.all()[robot.index()];
        answer.counts
            && self.barrier.presence(robot) == Presence::Present
            && self.barrier.incarnation(robot) == Some(answer.report.incarnation)
            && self.actuators.obey(robot)
            && self.world.energy_j(robot).is_none_or(|left_j| left_j > 0.0)
    }
}
