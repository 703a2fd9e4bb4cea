//! Cache validity of readings: if nothing changed, the latest readings of a robot and their hash still hold.
//!
//! The cache saves work for robots that stand still, with the same results as sensing in each step. Every change of a body
//! or of the floor calls one of the functions below. A mission returns a [`Validity`](crate::mission::Validity) with its part
//! of the readings.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use glam::Vec2;
use scenario::ids::RobotId;

use super::Floor;
use super::neighbor_cache::ROUNDING_M;

/// True if the latest readings of a robot still hold; false before the first reading. Only the thread that senses the robot
/// sets it while others sense.
#[derive(Debug, Default)]
pub(super) struct ReadingsCache(AtomicBool);

impl Clone for ReadingsCache {
    fn clone(&self) -> Self {
        Self(self.0.load(Relaxed).into())
    }
}

impl ReadingsCache {
    /// Invalidates the latest readings of the robot.
    #[inline]
    pub fn invalidate(&self) {
        self.0.store(false, Relaxed);
    }
}

impl Floor {
    /// Checks whether the readings of the last [`World::write_readings`](super::World::write_readings) call certainly still hold.
    #[must_use]
    #[inline]
    pub fn readings_are_valid(&self, robot: RobotId) -> bool {
        self.robots[robot.index()].unchanged.0.load(Relaxed)
    }

    /// Records that a robot has read its sensors. `lasts` is true if the readings hold until a function below is called.
    #[inline]
    pub(super) fn set_readings_valid(&self, robot: RobotId, lasts: bool) {
        let unchanged = &self.robots[robot.index()].unchanged;
        unchanged.0.store(lasts, Relaxed);
    }

    /// Invalidates the readings of a robot.
    #[inline]
    pub fn invalidate_readings(&self, robot: RobotId) {
        self.robots[robot.index()].unchanged.invalidate();
    }

    /// Invalidates the readings of all robots within `reach_m` of a place.
    pub fn invalidate_readings_near(&self, at: Vec2, reach_m: f32) {
        let near = self.bodies.near(at, reach_m + ROUNDING_M);
        near.for_each(|(rank, _)| self.robots[rank].unchanged.invalidate());
    }

    /// Invalidates the readings near a place where a body appeared, disappeared or moved by `way_m`, m.
    pub(super) fn invalidate_readings_around_body(&self, at: Vec2, way_m: f32) {
        self.invalidate_readings_near(at, self.near_m() + self.body.radius_m + way_m);
    }

    /// Invalidates the readings of all robots.
    pub(super) fn invalidate_all_readings(&self) {
        for robot in &self.robots {
            robot.unchanged.invalidate();
        }
    }
}
