//! What a robot has seen of a spill.

use std::f32::consts::TAU;

use glam::Vec2;

use super::sight::Sight;
use robot_agent::body::goal::{is_within, length};

/// Points on a ring inside the spill that together with its center stand for all of it.
const RING: usize = 6;
/// Radius of the ring, in radii of the spill.
const RING_RADII: f32 = 0.75;
/// Each point stands for what lies this near to it, in radii of the spill: together they cover it.
const AROUND_RADII: f32 = 0.5;
/// At a point the robot has seen it, however short its sight, m.
pub(super) const AT_POINT_M: f32 = 0.15;

/// What a robot has seen of a spill, point by point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Views {
    /// The center first.
    points: [Point; 1 + RING],
    around_m: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    at: Vec2,
    seen: bool,
    /// There is no way to it.
    blocked: bool,
}

impl Views {
    pub fn new(center: Vec2, radius_m: f32) -> Self {
        let at = |index: usize| {
            let Some(index) = index.checked_sub(1) else {
                return center;
            };
            let angle = TAU * index as f32 / RING as f32;
            center + Vec2::new(libm::cosf(angle), libm::sinf(angle)) * (radius_m * RING_RADII)
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

    /// Joins what is in sight.
    pub fn look(&mut self, sight: &Sight) {
        for point in self.points.iter_mut().filter(|point| !point.seen) {
            let at_it = || is_within(point.at - sight.position, AT_POINT_M);
            point.seen = sight.covers(point.at, self.around_m) || at_it();
        }
    }

    /// Where to go to see more: where the robot is going already, else to the nearest point that is still unseen; `None` when
    /// there is no such point left that can be reached.
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

    /// There is no way to that point.
    pub fn block(&mut self, at: Vec2) {
        for point in &mut self.points {
            point.blocked |= point.at == at;
        }
    }

    /// There is something to carry: all has to be looked over again after that.
    pub fn restart(&mut self) {
        for point in &mut self.points {
            point.seen = false;
        }
    }

    /// Points without a way to them may have one by now.
    pub fn unblock(&mut self) {
        for point in &mut self.points {
            point.blocked = false;
        }
    }

    /// The center, unless there is no way to it.
    pub fn center(&self) -> Option<Vec2> {
        let center = self.points.first().filter(|point| !point.blocked);
        center.map(|point| point.at)
    }

    /// Whether enough has been seen to say what is there; the rest may lie under obstacles.
    pub fn show_enough(&self) -> bool {
        let seen = self.points.iter().filter(|point| point.seen).count();
        2 * seen > self.points.len()
    }
}
