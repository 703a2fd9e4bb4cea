//! Driving to one place after another, for missions whose robots have known destinations and yield to no teammate.

use glam::Vec2;
use proto::readings::{Actuation, Readings};
use scenario::Setup;
use scenario::ids::RobotId;
use scenario::time::SimTime;

use super::goal::length;
use super::{Chassis, Goal, Navigator, Status, Surroundings};

#[derive(Clone, Debug)]
pub struct Driver {
    chassis: Chassis,
    navigator: Navigator,
    is_blocked: bool,
}

impl Driver {
    #[must_use]
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        Self {
            chassis: Chassis::new(scenario, &scenario.robots[robot.index()]),
            navigator: Navigator::default(),
            is_blocked: false,
        }
    }

    /// Returns the actuation toward within `within` m of `at`, around obstacles. A robot that is there, or has no
    /// position, stands still.
    #[must_use]
    pub fn drive_to(
        &mut self,
        at: Vec2,
        within: f32,
        readings: &Readings,
        now: SimTime,
    ) -> Actuation {
        self.is_blocked = false;
        Surroundings::from_readings(readings).map_or_else(Actuation::default, |around| {
            let goal = Goal::Place { at, within };
            let drive = self.navigator.drive(&self.chassis, goal, &around, [], now);
            self.is_blocked = drive.status == Status::Blocked;
            drive.actuation
        })
    }

    /// Returns whether the last call of [`Driver::drive_to`] found that no way leads to the place: the outline of the
    /// obstacle is closed, or the robot has not come nearer for a minute.
    #[must_use]
    pub fn is_blocked(&self) -> bool {
        self.is_blocked
    }

    /// Returns the travel time in a straight line at top speed, without turns, s.
    #[must_use]
    pub fn seconds(&self, from: Vec2, to: Vec2) -> f64 {
        f64::from(length(to - from) / self.chassis.speed_m_s)
    }
}
