//! To one place after another: all that a mission needs whose robots know where they have to go, and give way to nobody.

use alliance_proto::ids::RobotId;
use alliance_proto::readings::{Actuation, Readings};
use alliance_proto::scenario::Setup;
use alliance_proto::time::SimTime;
use glam::Vec2;

use super::goal::length;
use super::{Chassis, Goal, Navigator, Surroundings};

/// What a robot drives with, and where it is on its way.
#[derive(Clone, Debug)]
pub struct Driver {
    chassis: Chassis,
    navigator: Navigator,
}

impl Driver {
    /// A robot that has not moved yet.
    #[must_use]
    pub fn of(robot: RobotId, setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        Self {
            chassis: Chassis::of(scenario, &scenario.robots[robot.index()]),
            navigator: Navigator::default(),
        }
    }

    /// One step on the way to within `within` m of a place, m, round whatever is in the way. A robot that does not know where it is,
    /// or is there, stands still.
    #[must_use]
    pub fn drive_to(
        &mut self,
        at: Vec2,
        within: f32,
        readings: &Readings,
        now: SimTime,
    ) -> Actuation {
        Surroundings::of(readings).map_or_else(Actuation::default, |around| {
            let goal = Goal::Place { at, within };
            let drive = self.navigator.drive(&self.chassis, goal, &around, [], now);
            drive.actuation
        })
    }

    /// How long it takes straight from one place to another, at top speed and without a turn, s.
    #[must_use]
    pub fn seconds(&self, from: Vec2, to: Vec2) -> f64 {
        f64::from(length(to - from) / self.chassis.speed_m_s)
    }
}
