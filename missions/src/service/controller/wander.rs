//! Movement of a robot without a task: to random places, to explore or to clear the way.

use glam::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::Room;
use scenario::ids::RobotId;
use scenario::rng::{Purpose, robot_stream};
use scenario::time::SimTime;

/// The time after which a place that was not reached is given up.
const PATIENCE: SimTime = SimTime(60_000);

#[derive(Clone, Debug)]
pub(super) struct Wander {
    rng: ChaCha8Rng,
    to: Vec2,
    until: SimTime,
}

impl Wander {
    pub fn new(seed: u64, robot: RobotId) -> Self {
        Self {
            rng: robot_stream(seed, Purpose::Behavior, robot),
            to: Vec2::ZERO,
            until: SimTime::ZERO,
        }
    }

    /// Checks whether the robot is still driving to its last random place.
    pub fn is_driving(&self, position: Vec2, near_m: f32, now: SimTime) -> bool {
        now < self.until && position.distance(self.to) > near_m
    }

    pub fn end(&mut self) {
        self.until = SimTime::ZERO;
    }

    /// Returns the current destination. Draws a new place in the room, m, if the last one was reached or given up.
    pub fn next(&mut self, position: Vec2, near_m: f32, room: &Room, now: SimTime) -> Vec2 {
        if !self.is_driving(position, near_m, now) {
            self.to = room.at(Vec2::new(self.rng.random(), self.rng.random()));
            self.until = now + PATIENCE;
        }
        self.to
    }
}
