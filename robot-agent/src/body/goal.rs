//! Where a robot wants to get.

use glam::Vec2;

/// Where a robot wants to get.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Within that distance of a point, m.
    Place {
        /// The point, m.
        at: Vec2,
        /// How near is near enough, m.
        within: f32,
    },
    /// On and on in a direction, a unit vector.
    Direction(Vec2),
}

impl Goal {
    /// What is left of the way, m. For a direction only differences mean something; it never ends.
    #[must_use]
    pub fn remaining(&self, position: Vec2) -> f32 {
        match *self {
            Self::Place { at, within } => length(at - position) - within,
            Self::Direction(direction) => -position.dot(direction),
        }
    }

    /// Whether nothing is left of the way.
    #[must_use]
    pub fn is_reached(&self, position: Vec2) -> bool {
        matches!(self, Self::Place { .. }) && self.remaining(position) <= 0.0
    }

    /// How far the robot goes straight ahead to arrive, m: a little too far, for rounding would keep it short of the goal for
    /// ever.
    #[must_use]
    pub fn way(&self, position: Vec2) -> f32 {
        const BEYOND_M: f32 = 0.005;
        match self {
            Self::Place { .. } => self.remaining(position) + BEYOND_M,
            Self::Direction(_) => f32::INFINITY,
        }
    }

    /// Direction from `position`, rad counter-clockwise from x.
    #[must_use]
    pub fn direction(&self, position: Vec2) -> f32 {
        let offset = match *self {
            Self::Place { at, .. } => at - position,
            Self::Direction(direction) => direction,
        };
        libm::atan2f(offset.y, offset.x)
    }

    /// Whether a detour that was begun for `other` still serves this goal.
    #[must_use]
    pub fn continues(&self, other: &Self) -> bool {
        /// Sensed items shift a little as the robot moves; a new goal is farther than that.
        const SAME_M: f32 = 0.25;
        match (self, other) {
            (Self::Place { at, .. }, Self::Place { at: before, .. }) => {
                length(*at - *before) < SAME_M
            }
            (Self::Direction(now), Self::Direction(before)) => now.dot(*before) > 0.99,
            _ => false,
        }
    }
}

/// Length of a vector, with the same bits on every platform.
#[must_use]
pub fn length(vector: Vec2) -> f32 {
    libm::hypotf(vector.x, vector.y)
}
