//! The parts of a spill that a robot has seen.

use std::f32::consts::TAU;

use glam::Vec2;

use super::sight::FloorView;
use robot_agent::body::goal::{is_within, length};

/// The number of points on a ring inside the spill that represent the spill, together with its center.
const RING: usize = 6;
const RING_RADII: f32 = 0.75;
/// The radius that each point represents, in radii of the spill. Together the points cover the spill.
const AROUND_RADII: f32 = 0.5;
/// The distance to a point at which the robot has seen it even with a short sensor range, m.
pub(super) const AT_POINT_M: f32 = 0.15;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Views {
    /// The points, the center first.
    points: [Point; 1 + RING],
    around_m: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    at: Vec2,
    seen: bool,
    blocked: bool,
}

impl Views {
    pub fn new(center: Vec2, radius_m: f32) -> Self {
        let at = |index: usize| {
            let Some(index) = index.checked_sub(1) else {
                return center;
            };
            let angle = TAU * index as f32 / RING as f32;
            center + Vec2::from_angle(angle) * (radius_m * RING_RADII)
        };
        Self {
            points: std::array::from_fn(|index| Point {
                at: at(index),
                seen: false,
                blocked: false,
            }),
            around_m: radius_m * AROUND_RADII,
        }
    }

    pub fn update(&mut self, sight: &FloorView) {
        for point in self.points.iter_mut().filter(|point| !point.seen) {
            let at_it = || is_within(point.at - sight.position, AT_POINT_M);
            point.seen = sight.covers(point.at, self.around_m) || at_it();
        }
    }

    /// Returns the next point to visit: the current destination, or the nearest unseen point. Returns `None` if no such
    /// point is reachable.
    pub fn next(&self, position: Vec2, going: Option<Vec2>) -> Option<Vec2> {
        let distance = |point: &&Point| length(point.at - position);
        let open = || {
            self.points
                .iter()
                .filter(|point| !point.seen && !point.blocked)
        };
        let same = open().find(|point| going == Some(point.at));
        same.or_else(|| open().min_by(|a, b| distance(a).total_cmp(&distance(b))))
            .map(|point| point.at)
    }

    pub fn block(&mut self, at: Vec2) {
        for point in &mut self.points {
            point.blocked |= point.at == at;
        }
    }

    /// Marks all points as unseen, because waste was found and everything has to be seen again after that.
    pub fn restart(&mut self) {
        for point in &mut self.points {
            point.seen = false;
        }
    }

    /// Removes all blocks, because ways may have opened.
    pub fn unblock(&mut self) {
        for point in &mut self.points {
            point.blocked = false;
        }
    }

    pub fn center(&self) -> Option<Vec2> {
        let center = self.points.first().filter(|point| !point.blocked);
        center.map(|point| point.at)
    }

    /// Checks whether most points were seen. The others may lie under obstacles.
    pub fn are_sufficient(&self) -> bool {
        let seen = self.points.iter().filter(|point| point.seen).count();
        2 * seen > self.points.len()
    }
}
