//! What stays true of a robot's surroundings for some steps, so that they are not searched in each: it moves a few centimetres
//! in a step, and what it is far from stays far. The idea is the skin round the neighbor lists of molecular dynamics (Verlet,
//! Phys. Rev. 159, 98, 1967).

use std::cell::Cell;

use alliance_proto::ids::RobotId;
use glam::Vec2;

use super::Floor;

/// A search looks this much farther than a step needs, m.
const SKIRT_M: f32 = 2.0;

/// What rounding may make of a distance, m.
pub(super) const ROUNDING_M: f32 = 0.01;

/// What is known of one robot's surroundings. Nothing of it is part of the world's state: it only saves searches.
#[derive(Clone, Debug, Default)]
pub(super) struct Vicinity {
    /// How far the nearest other body's center was when it was looked for, plus twice the [`Drift`] until then, m: two bodies come
    /// no nearer to each other than by twice the drift.
    others_m: Cell<f64>,
}

/// Around a point, m: where something is known to hold. By default it is empty.
#[derive(Clone, Copy, Debug, Default)]
pub struct Circle {
    center: Vec2,
    squared: f32,
}

impl Circle {
    /// Of that radius, less what rounding may take; of a radius below that there is none.
    #[must_use]
    pub fn new(center: Vec2, radius_m: f32) -> Self {
        let radius_m = (radius_m - ROUNDING_M).max(0.0);
        Self {
            center,
            squared: radius_m * radius_m,
        }
    }

    /// Whether a point is in it.
    #[must_use]
    pub fn contains(&self, point: Vec2) -> bool {
        (point - self.center).length_squared() < self.squared
    }
}

/// How far bodies have moved at most.
#[derive(Clone, Debug)]
pub(super) struct Drift {
    /// No body has moved farther than this since the start, m.
    total_m: f64,
    /// No body has moved farther than this in the step at hand, m.
    step_m: f32,
    /// What rounding may add in a step, m.
    rounding_m: f32,
}

impl Drift {
    /// In a room of that size.
    pub fn new(size: Vec2) -> Self {
        Self {
            total_m: 0.0,
            step_m: 0.0,
            rounding_m: size.max_element() * f32::EPSILON,
        }
    }

    pub fn begin_step(&mut self) {
        self.step_m = 0.0;
        self.total_m += f64::from(self.rounding_m);
    }

    /// A body moves by so much in the step at hand.
    pub fn moves(&mut self, way_m: f32) {
        if way_m > self.step_m {
            self.total_m += f64::from(way_m - self.step_m);
            self.step_m = way_m;
        }
    }

    /// A body is put elsewhere: what was known of others' distances holds no more.
    pub fn jumps(&mut self, size: Vec2) {
        self.total_m += f64::from(size.x + size.y);
    }
}

impl Floor {
    /// Whether another body may be within reach of a robot's center; looks for it only if that is not known.
    pub(super) fn may_meet(&self, robot: RobotId, reach_m: f32) -> bool {
        if self.is_alone(robot, reach_m) {
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
        !self.is_alone(robot, reach_m)
    }

    /// Whether for certain no other body is within reach of a robot's center, as far as is known.
    pub(super) fn is_alone(&self, robot: RobotId, reach_m: f32) -> bool {
        let known_m = self.robots[robot.index()].vicinity.others_m.get();
        let apart_m = known_m - 2.0 * self.drift.total_m;
        apart_m > f64::from(reach_m + self.body.radius_m + ROUNDING_M)
    }
}
