//! The value of an allocation, by one measure for all allocators.

use std::collections::BTreeSet;

use glam::Vec2;
use missions::Registry;
use missions::service::data::{SERVICE, ServiceSection, TaskGranularity, points};
use scenario::Setup;
use scenario::ids::TaskId;

/// The cost of an allocation, s: each robot drives through its tasks from its start, the nearest next, and works on each.
#[derive(Clone, Debug, PartialEq)]
pub struct Objective {
    /// The time of each robot for all of its tasks, by rank, s.
    pub robots_s: Vec<f64>,
    /// The number of tasks that at least one robot has.
    pub assigned: usize,
    /// The number of tasks that more than one robot has.
    pub shared: usize,
    /// The number of tasks in all.
    pub tasks: usize,
}

impl Objective {
    /// Returns the objective of an allocation; `None` if tasks have no places.
    ///
    /// # Errors
    /// Returns an error if robots have no start.
    pub fn new(setup: &Setup, robots: &[BTreeSet<TaskId>]) -> anyhow::Result<Option<Self>> {
        let scenario = &setup.scenario;
        if scenario.mission() != SERVICE
            || ServiceSection::of(scenario).tasks != TaskGranularity::Points
        {
            return Ok(None);
        }
        let section = ServiceSection::of(scenario);
        let starts = Registry::current()
            .worlds()
            .find(scenario)?
            .start_poses(scenario)?;
        let points = points(scenario, setup.seed);
        let of_robot = |(rank, tasks): (usize, &BTreeSet<TaskId>)| {
            let robot = &scenario.robots[rank];
            let speed_m_s = f64::from(scenario.body_of(robot).speed_m_s);
            let mut left: Vec<usize> = tasks.iter().map(|task| task.index()).collect();
            let mut at = starts.get(rank).map_or(Vec2::ZERO, |pose| pose.position);
            let mut total_s = 0.0;
            while let Some(next) = nearest(at, &left, |task| points.get(task).map(|point| point.at))
            {
                let task = left.swap_remove(next);
                let point = &points[task];
                let way_m = f64::from((at.distance(point.at) - section.reach_m).max(0.0));
                let skill = robot.skill(&section.kinds[point.kind].name).unwrap_or(1.0);
                total_s += way_m / speed_m_s + point.work_s / skill;
                at = point.at;
            }
            total_s
        };
        let count = |least: usize| {
            let holders = |task: &usize| {
                let has =
                    |tasks: &&BTreeSet<TaskId>| tasks.iter().any(|each| each.index() == *task);
                robots.iter().filter(has).count()
            };
            (0..points.len())
                .filter(|task| holders(task) >= least)
                .count()
        };
        Ok(Some(Self {
            robots_s: robots.iter().enumerate().map(of_robot).collect(),
            assigned: count(1),
            shared: count(2),
            tasks: points.len(),
        }))
    }

    /// Returns the sum over all robots, s.
    #[must_use]
    pub fn sum_s(&self) -> f64 {
        self.robots_s.iter().sum()
    }

    /// Returns the longest time of a robot, s.
    #[must_use]
    pub fn longest_s(&self) -> f64 {
        self.robots_s.iter().copied().fold(0.0, f64::max)
    }
}

/// Returns the place in `left` of the task that is nearest to `at`. Of equal ones, it is the first. Tasks without a place
/// are left out.
fn nearest(at: Vec2, left: &[usize], place: impl Fn(usize) -> Option<Vec2>) -> Option<usize> {
    let places = left.iter().enumerate();
    let places = places.filter_map(|(index, task)| Some((index, place(*task)?)));
    places
        .min_by(|(_, a), (_, b)| at.distance(*a).total_cmp(&at.distance(*b)))
        .map(|(index, _)| index)
}
