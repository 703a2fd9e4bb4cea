//! Search results that stay valid for several steps, because bodies move only a few centimeters per step. The method is the
//! skin round the neighbor lists of molecular dynamics (Verlet, Phys. Rev. 159, 98, 1967).

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};

use glam::Vec2;
use scenario::Room;
use scenario::ids::RobotId;

use super::Floor;

/// The additional radius of a search, m. A larger value makes searches rarer and longer.
const SKIRT_M: f32 = 2.0;

/// The largest rounding error of a distance, m.
pub(super) const ROUNDING_M: f32 = 0.01;

/// The cached surroundings of one robot. They only save searches and are not part of the world's state.
///
/// Only the thread that senses or moves the robot uses its caches, so their accesses need no order.
#[derive(Debug, Default)]
pub(super) struct NeighborCache {
    /// The bits of a distance, m: that to the nearest other body at the last search, plus twice the [`Drift`] at that time.
    /// Two bodies approach each other by at most twice the drift.
    others_m: AtomicU64,
}

impl Clone for NeighborCache {
    fn clone(&self) -> Self {
        Self {
            others_m: self.others_m.load(Relaxed).into(),
        }
    }
}

/// A circle in which a cached result holds, m. The default circle is empty.
#[derive(Clone, Copy, Debug, Default)]
pub struct Circle {
    center: Vec2,
    squared: f32,
}

impl Circle {
    /// Creates a circle whose radius is reduced by the rounding error; it is empty if nothing remains.
    #[must_use]
    pub fn new(center: Vec2, radius_m: f32) -> Self {
        let radius_m = (radius_m - ROUNDING_M).max(0.0);
        Self {
            center,
            squared: radius_m * radius_m,
        }
    }

    #[must_use]
    pub fn contains(&self, point: Vec2) -> bool {
        (point - self.center).length_squared() < self.squared
    }
}

/// A circle with a number, as the cache of one robot: a new result replaces both behind a shared reference. Only the thread
/// that senses the robot may use the cache.
#[derive(Debug, Default)]
pub struct CircleCache {
    /// The bits of both coordinates.
    center: AtomicU64,
    squared: AtomicU32,
    value: AtomicU32,
}

impl CircleCache {
    /// Returns the cached circle and its number. A new cache contains an empty circle and 0.
    #[must_use]
    pub fn get(&self) -> (Circle, u32) {
        let center = self.center.load(Relaxed);
        let circle = Circle {
            center: Vec2::new(
                f32::from_bits(center as u32),
                f32::from_bits((center >> 32) as u32),
            ),
            squared: f32::from_bits(self.squared.load(Relaxed)),
        };
        (circle, self.value.load(Relaxed))
    }

    /// Replaces the cached circle and its number.
    pub fn set(&self, circle: Circle, value: u32) {
        let [x, y] = circle.center.to_array().map(f32::to_bits).map(u64::from);
        self.center.store(x | (y << 32), Relaxed);
        self.squared.store(circle.squared.to_bits(), Relaxed);
        self.value.store(value, Relaxed);
    }

    /// Replaces the cached circle by an empty one.
    pub fn clear(&self) {
        self.set(Circle::default(), 0);
    }
}

impl Clone for CircleCache {
    fn clone(&self) -> Self {
        let copy = Self::default();
        let (circle, value) = self.get();
        copy.set(circle, value);
        copy
    }
}

#[derive(Clone, Debug)]
pub(super) struct Drift {
    /// The upper limit of each body's path since the start, m.
    total_m: f64,
    /// The upper limit of each body's path in the current step, m.
    step_m: f32,
    /// The largest rounding error of one step, m.
    rounding_m: f32,
}

impl Drift {
    pub fn new(room: &Room) -> Self {
        Self {
            total_m: 0.0,
            step_m: 0.0,
            rounding_m: room.farthest_m() * f32::EPSILON,
        }
    }

    pub fn begin_step(&mut self) {
        self.step_m = 0.0;
        self.total_m += f64::from(self.rounding_m);
    }

    /// Records that a body has moved by `way_m` in the current step.
    pub fn record_move(&mut self, way_m: f32) {
        if way_m > self.step_m {
            self.total_m += f64::from(way_m - self.step_m);
            self.step_m = way_m;
        }
    }

    /// Records that a body was placed elsewhere, which invalidates the cached distances of all bodies.
    pub fn record_jump(&mut self, room: &Room) {
        self.total_m += f64::from(room.size().element_sum());
    }
}

impl Floor {
    /// Checks whether another body may be within reach of a robot's center. Searches only if the cache does not exclude it.
    pub(super) fn may_have_neighbor(&self, robot: RobotId, reach_m: f32) -> bool {
        if self.has_no_neighbor(robot, reach_m) {
            return false;
        }
        let body = &self.robots[robot.index()];
        let far_m = reach_m + self.body.radius_m + SKIRT_M;
        let position = body.position();
        let near = self.bodies.near(position, far_m);
        let others = near.filter(|(rank, _)| *rank != robot.index());
        let squared = others.map(|(_, at)| (at - position).length_squared());
        let nearest_m = squared.fold(far_m * far_m, f32::min).sqrt();
        let known_m = f64::from(nearest_m) + 2.0 * self.drift.total_m;
        body.vicinity.others_m.store(known_m.to_bits(), Relaxed);
        !self.has_no_neighbor(robot, reach_m)
    }

    /// Checks whether the cache excludes other bodies within reach of a robot's center.
    pub(super) fn has_no_neighbor(&self, robot: RobotId, reach_m: f32) -> bool {
        let known_m = &self.robots[robot.index()].vicinity.others_m;
        let known_m = f64::from_bits(known_m.load(Relaxed));
        let apart_m = known_m - 2.0 * self.drift.total_m;
        apart_m > f64::from(reach_m + self.body.radius_m + ROUNDING_M)
    }
}
