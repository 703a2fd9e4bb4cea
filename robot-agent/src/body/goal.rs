//! Where a robot wants to get.

use std::ops::Range;

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
    #[inline]
    #[must_use]
    pub fn remaining(&self, position: Vec2) -> f32 {
        match *self {
            Self::Place { at, within } => length(at - position) - within,
            Self::Direction(direction) => -position.dot(direction),
        }
    }

    /// Whether nothing is left of the way.
    #[inline]
    #[must_use]
    pub fn is_reached(&self, position: Vec2) -> bool {
        matches!(self, Self::Place { .. }) && self.remaining(position) <= 0.0
    }

    /// How far the robot goes straight ahead to arrive, m: a little too far, for rounding would keep it short of the goal for
    /// ever.
    #[inline]
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
    #[inline]
    #[must_use]
    pub fn continues(&self, other: &Self) -> bool {
        /// Sensed items shift a little as the robot moves; a new goal is farther than that.
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

/// Length of a vector, with the same bits on every platform: those of [`libm::hypotf`].
#[inline]
#[must_use]
pub fn length(vector: Vec2) -> f32 {
    // Squares of such numbers neither overflow nor vanish, so that they need not be scaled.
    const USUAL: Range<f32> = 1e-15..1e15;
    if USUAL.contains(&vector.abs().max_element()) {
        let (x, y) = (f64::from(vector.x), f64::from(vector.y));
        ((x * x + y * y) as f32).sqrt()
    } else {
        libm::hypotf(vector.x, vector.y)
    }
}

/// Whether a vector is shorter than that: the same as `length(vector) < limit_m`, mostly without a root.
#[inline]
#[must_use]
pub fn is_shorter(vector: Vec2, limit_m: f32) -> bool {
    // No vector is shorter than its longer coordinate, rounded or not.
    vector.abs().max_element() < limit_m && length(vector) < limit_m
}

/// Whether a vector is no longer than that: the same as `length(vector) <= limit_m`, mostly without a root.
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
