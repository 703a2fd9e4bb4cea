//! The loads of robots: what they deliver, and the demands that they take for the rest of the run.

use scenario::ids::RobotId;
use world_server::mission::StepEvents;
use world_server::world::Floor;

use super::Service;
use crate::service::data;

impl Service {
    /// Lets a robot deliver the load that it carries, if it is within reach of the place.
    pub(super) fn deliver(
        &mut self,
        robot: RobotId,
        point: u32,
        floor: &Floor,
        happened: &mut StepEvents,
    ) {
        let distance = floor.pose(robot).position.distance(self.points.at(point));
        if self.points.carrier(point) != Some(robot) || distance > self.constants.section.reach_m {
            return;
        }
        self.robots[robot.index()].load = None;
        self.robots[robot.index()].works = Some(point);
        let now = floor.now();
        let change = self.points.finish(point, now);
        self.log
            .add(&self.points, point, change, Some(robot), now, happened);
        self.announce(point, floor);
    }

    /// Returns the load of a robot to its first place.
    pub(super) fn drop_load(&mut self, robot: RobotId, floor: &Floor, happened: &mut StepEvents) {
        let load = self.robots[robot.index()].load.take();
        // The load of a point that has expired is gone.
        let Some(point) = load.filter(|point| self.points.carrier(*point) == Some(robot)) else {
            return;
        };
        let worker = &mut self.robots[robot.index()];
        // The robot does not leave the point in addition.
        worker.worked = worker.worked.filter(|worked| *worked != point);
        self.points.drop_load(point);
        happened
            .push_mission_event("load-lost", Some(robot))
            .subject = format!("p{point}");
        self.announce(point, floor);
    }

    /// Returns the sum of the demands that a robot carries.
    pub(super) fn load_of(&self, robot: RobotId) -> f64 {
        let robot = &self.robots[robot.index()];
        let on_the_way = robot
            .load
            .map_or(0.0, |point| self.points.spec(point).demand);
        robot.taken.unwrap_or(0.0) + on_the_way
    }

    /// Returns whether a robot can take a further demand. A load on its way does not count, because the robot drops it
    /// when it begins other work.
    pub(super) fn has_capacity(&self, robot: RobotId, demand: f64) -> bool {
        let taken = self.robots[robot.index()].taken.unwrap_or(0.0);
        data::fits(taken, demand, self.constants.capacities[robot.index()])
    }

    /// Checks that no robot carries more than its capacity.
    pub(super) fn check_loads(&self) -> Result<(), String> {
        let mut robots = (0..self.robots.len() as u32).map(RobotId);
        let over = robots.find(|robot| {
            let capacity = self.constants.capacities[robot.index()];
            !data::fits(0.0, self.load_of(*robot), capacity)
        });
        over.map_or(Ok(()), |robot| {
            let load = self.load_of(robot);
            Err(format!(
                "robot {} carries {load}, above its capacity",
                robot.0
            ))
        })
    }
}
