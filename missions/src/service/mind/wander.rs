//! Where a robot without a task goes: to a place drawn from its own stream, to look round or to be in nobody's way.

use alliance_proto::ids::RobotId;
use alliance_proto::rng::{Purpose, robot_stream};
use alliance_proto::time::SimTime;
use glam::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A place that takes longer to get to is given up.
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

    /// Whether it has not yet come to the place that it was sent to last.
    pub fn is_on_its_way(&self, position: Vec2, near_m: f32, now: SimTime) -> bool {
        now < self.until && position.distance(self.to) > near_m
    }

    /// It has something better to do.
    pub fn end(&mut self) {
        self.until = SimTime::ZERO;
    }

    /// Where to go now, in a room of that size, m.
    pub fn next(&mut self, position: Vec2, near_m: f32, room: Vec2, now: SimTime) -> Vec2 {
        if !self.is_on_its_way(position, near_m, now) {
            self.to = room * Vec2::new(self.rng.random(), self.rng.random());
            self.until = now + PATIENCE;
        }
        self.to
    }
}
