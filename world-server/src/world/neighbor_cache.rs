//! Search results that stay valid for several steps, because bodies move only a few centimeters per step. The method is the
//! skin round the neighbor lists of molecular dynamics (Verlet, Phys. Rev. 159, 98, 1967).

use std::cell::Cell;

use glam::Vec2;
use scenario::Room;
use scenario::ids::RobotId;

use super::Floor;

/// The additional radius of a search, m. A larger value makes searches rarer and longer.
const SKIRT_M: f32 = 2.0;

/// The largest rounding error of a distance, m.
pub(super) const ROUNDING_M: f32 = 0.01;

/// The cached surroundings of one robot. They only save searches and are not part of the world's state.
#[derive(Clone, Debug, Default)]
pub(super) struct NeighborCache {
    /// The distance to the nearest other body at the last search, plus twice the [`Drift`] at that time, m. Two bodies
    /// approach each other by at most twice the drift.
    others_m: Cell<f64>,
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
        body.vicinity.others_m.set(known_m);
        !self.has_no_neighbor(robot, reach_m)
    }

    /// Checks whether the cache excludes other bodies within reach of a robot's center.
    pub(super) fn has_no_neighbor(&self, robot: RobotId, reach_m: f32) -> bool {
        let known_m = self.robots[robot.index()].vicinity.others_m.get();
        let apart_m = known_m - 2.0 * self.drift.total_m;
        apart_m > f64::from(reach_m + self.body.radius_m + ROUNDING_M)
    }
}
