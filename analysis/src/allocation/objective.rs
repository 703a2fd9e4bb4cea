//! The value of an allocation, by one measure for all allocators.

use std::collections::BTreeSet;

use glam::Vec2;
use missions::Registry;
use missions::service::data::{SERVICE, ServiceSection, Slots, TaskGranularity, points};
use scenario::ids::TaskId;
use scenario::{Setup, fill_slots};

/// The cost of an allocation, s: each robot drives through its points from its start, the nearest next, works on each,
/// and delivers its load. Windows, waits for other robots and obstacles are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Objective {
    /// The time of each robot for all of its tasks, by rank, s.
    pub robots_s: Vec<f64>,
    /// The number of points that robots have. If a point has slots, these are different robots for all slots.
    pub assigned: usize,
    /// The number of points of which more than one robot has the same task.
    pub shared: usize,
    /// The number of points in all.
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
        let slots = Slots::new(section);
        let of_robot = |(rank, tasks): (usize, &BTreeSet<TaskId>)| {
            let robot = &scenario.robots[rank];
            let speed_m_s = f64::from(scenario.body_of(robot).speed_m_s);
            // A robot with several slots of a point drives there once.
            let left: BTreeSet<u32> = tasks.iter().map(|task| slots.point(*task)).collect();
            let mut left: Vec<u32> = left.into_iter().collect();
            let mut at = starts.get(rank).map_or(Vec2::ZERO, |pose| pose.position);
            let mut total_s = 0.0;
            let place = |number: u32| points.get(number as usize).map(|point| point.at);
            while let Some(next) = nearest(at, &left, place) {
                let number = left.swap_remove(next);
                let point = &points[number as usize];
                let way_m = f64::from((at.distance(point.at) - section.reach_m).max(0.0));
                let skill = match slots.of_point(number) {
                    [] => robot.skill(&section.kinds[point.kind].name).unwrap_or(1.0),
                    _ => 1.0,
                };
                total_s += way_m / speed_m_s + point.work_s / skill;
                at = point.at;
                if let Some(to) = point.deliver_to {
                    total_s += f64::from(at.distance(to)) / speed_m_s;
                    at = to;
                }
            }
            total_s
        };
        let tasks_of = |number: u32| -> Vec<TaskId> {
            match slots.of_point(number) {
                [] => vec![TaskId(number)],
                slots => slots.iter().map(|slot| slot.task).collect(),
            }
        };
        let is_assigned = |number: &u32| {
            let tasks = tasks_of(*number);
            let all = (0..robots.len()).map(|rank| (rank, None));
            let filled = fill_slots(tasks.len(), all, |rank: usize, slot| {
                robots[rank].contains(&tasks[slot])
            });
            filled.iter().all(Option::is_some)
        };
        let is_shared = |number: &u32| {
            let has = |task: &TaskId| robots.iter().filter(|tasks| tasks.contains(task)).count();
            tasks_of(*number).iter().any(|task| has(task) > 1)
        };
        let numbers = (0..=u32::MAX).take(points.len());
        Ok(Some(Self {
            robots_s: robots.iter().enumerate().map(of_robot).collect(),
            assigned: numbers.clone().filter(is_assigned).count(),
            shared: numbers.filter(is_shared).count(),
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

/// Returns the place in `left` of the point that is nearest to `at`. Of equal ones, it is the first. Points without a
/// place are left out.
fn nearest(at: Vec2, left: &[u32], place: impl Fn(u32) -> Option<Vec2>) -> Option<usize> {
    let places = left.iter().enumerate();
    let places = places.filter_map(|(index, task)| Some((index, place(*task)?)));
    places
        .min_by(|(_, a), (_, b)| at.distance(*a).total_cmp(&at.distance(*b)))
        .map(|(index, _)| index)
}
