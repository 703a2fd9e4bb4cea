//! "Nothing has changed": what a robot sensed last still holds, so that it is not worked out again, and neither is its hash.
//!
//! It saves sensing and hashing for a robot that stands still where nothing moves (BENCHMARKS.md), and equals sensing anew in each
//! step. Here is all of it: who moves, turns, comes, leaves or changes the floor says so by one of the functions below, and a mission says with
//! [`Validity`](crate::mission::Validity) how long its part holds.

use std::cell::Cell;

use alliance_proto::ids::RobotId;
use glam::Vec2;

use super::Floor;
use super::vicinity::ROUNDING_M;

/// Whether what a robot sensed last still holds; at first it has sensed nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Unchanged(Cell<bool>);

impl Unchanged {
    /// The robot may sense something else from now on.
    #[inline]
    pub fn end(&self) {
        self.0.set(false);
    }
}

impl Floor {
    /// Whether a robot senses what it sensed when [`World::sense`](super::World::sense) was called last, for certain.
    #[must_use]
    #[inline]
    pub fn senses_the_same(&self, robot: RobotId) -> bool {
        self.robots[robot.index()].unchanged.0.get()
    }

    /// A robot has sensed, and whether that holds until something below is called.
    #[inline]
    pub(super) fn sensed(&self, robot: RobotId, lasts: bool) {
        self.robots[robot.index()].unchanged.0.set(lasts);
    }

    /// A robot may sense something else than before.
    #[inline]
    pub fn changed(&self, robot: RobotId) {
        self.robots[robot.index()].unchanged.end();
    }

    /// Robots that near may sense something else than before.
    pub fn changed_near(&self, at: Vec2, reach_m: f32) {
        let near = self.bodies.near(at, reach_m + ROUNDING_M);
        near.for_each(|(rank, _)| self.robots[rank].unchanged.end());
    }

    /// A body has come there, left from there, or moved by that way, m: whoever is near senses something else.
    pub(super) fn disturbed(&self, at: Vec2, way_m: f32) {
        self.changed_near(at, self.near_m() + self.body.radius_m + way_m);
    }

    /// Anybody may sense something else now.
    pub(super) fn all_changed(&self) {
        for robot in &self.robots {
            robot.unchanged.end();
        }
    }
}
