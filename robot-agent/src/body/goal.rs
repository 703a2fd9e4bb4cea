//! The goal of a robot's motion, and vector lengths.

use std::ops::Range;

use glam::Vec2;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// A point to approach.
    Place {
        at: Vec2,
        /// The distance at which the goal is reached, m.
        within: f32,
    },
    /// A direction to keep without end, as a unit vector.
    Direction(Vec2),
}

impl Goal {
    /// Returns the remaining distance, m. For a direction only differences of the result have a meaning.
    #[inline]
    #[must_use]
    pub fn remaining(&self, position: Vec2) -> f32 {
        match *self {
            Self::Place { at, within } => length(at - position) - within,
            Self::Direction(direction) => -position.dot(direction),
        }
    }

    /// Returns whether the robot is at the goal. A direction is never reached.
    #[inline]
    #[must_use]
    pub fn is_reached(&self, position: Vec2) -> bool {
        matches!(self, Self::Place { .. }) && self.remaining(position) <= 0.0
    }

    /// Returns the distance to drive straight ahead, m. It is slightly too large, because rounding could stop the
    /// robot short of the goal.
    #[inline]
    #[must_use]
    pub fn distance_to_drive(&self, position: Vec2) -> f32 {
        const BEYOND_M: f32 = 0.005;
        match self {
            Self::Place { .. } => self.remaining(position) + BEYOND_M,
            Self::Direction(_) => f32::INFINITY,
        }
    }

    /// Returns the direction from `position`, rad counter-clockwise from x.
    #[must_use]
    pub fn direction(&self, position: Vec2) -> f32 {
        let offset = match *self {
            Self::Place { at, .. } => at - position,
            Self::Direction(direction) => direction,
        };
        libm::atan2f(offset.y, offset.x)
    }

    /// Returns whether a detour that began for `other` also serves this goal.
    #[inline]
    #[must_use]
    pub fn continues(&self, other: &Self) -> bool {
        /// The largest shift of one goal, m. A sensed object shifts a little as the robot moves.
        const SAME_M: f32 = 0.25;
        match (self, other) {
            (Self::Place { at, .. }, Self::Place { at: before, .. }) => {
                at == before || is_shorter(*at - *before, SAME_M)
            }
            (Self::Direction(now), Self::Direction(before)) => now.dot(*before) > 0.99,
            _ => false,
        }
    }
}

/// Returns the length of a vector, with the bits of [`libm::hypotf`] on every platform.
#[inline]
#[must_use]
pub fn length(vector: Vec2) -> f32 {
    // Squares of numbers in this range neither overflow nor vanish, so no scaling is necessary.
    const USUAL: Range<f32> = 1e-15..1e15;
    if USUAL.contains(&vector.abs().max_element()) {
        let (x, y) = (f64::from(vector.x), f64::from(vector.y));
        ((x * x + y * y) as f32).sqrt()
    } else {
        libm::hypotf(vector.x, vector.y)
    }
}

/// Returns `length(vector) < limit_m`, in most cases without a square root.
#[inline]
#[must_use]
pub fn is_shorter(vector: Vec2, limit_m: f32) -> bool {
    // The length is never below the longer coordinate, rounded or not.
    vector.abs().max_element() < limit_m && length(vector) < limit_m
}

/// Returns `length(vector) <= limit_m`, in most cases without a square root.
#[inline]
#[must_use]
pub fn is_within(vector: Vec2, limit_m: f32) -> bool {
    vector.abs().max_element() <= limit_m && length(vector) <= limit_m
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_length_has_the_bits_of_hypotf(x in any::<f32>(), y in any::<f32>(), apart in -40..40_i32) {
            let near = f32::from_bits(x.to_bits() & 0x807f_ffff | 0x3f80_0000);
            let scaled = near * 2.0_f32.powi(apart);
            let few = [x, y, near, scaled, 0.0, -0.0, 1.0, 3e-16, f32::MAX, f32::INFINITY, f32::NAN];
            for x in few {
                for y in few {
                    let expected = libm::hypotf(x, y);
                    let found = length(Vec2::new(x, y));
                    prop_assert!(found == expected || (found.is_nan() && expected.is_nan()), "{x} {y}: {found} {expected}");
                    if x.is_nan() || y.is_nan() {
                        continue;
                    }
                    for limit in [expected, expected.next_up(), expected.next_down(), 0.3, f32::NAN] {
                        prop_assert_eq!(is_shorter(Vec2::new(x, y), limit), expected < limit, "{} {}", x, y);
                        prop_assert_eq!(is_within(Vec2::new(x, y), limit), expected <= limit, "{} {}", x, y);
                    }
                }
            }
        }
    }
}
