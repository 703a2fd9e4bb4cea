//! Rectangles on the floor, placed by a scenario or by a fault.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::Problem;
use super::limits::{FARTHEST_M, NumberRange, PENETRABILITY, above, above_zero, closed};
use super::path::KeyPath;

/// A rectangle on the floor that blocks, slows down or speeds up robots.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// The x coordinate of the lower left corner, m.
    pub x_m: f32,
    /// The y coordinate of the lower left corner, m.
    pub y_m: f32,
    /// Extent in x, m.
    pub width_m: f32,
    /// Extent in y, m.
    pub height_m: f32,
    /// The penetrability: [0, 0.1] is solid, (0.1, 1) slows a robot by that factor, 1 is neutral, above 1 speeds it up
    /// (thesis §3.2.2.1).
    #[serde(default)]
    pub penetrability: f32,
}

impl Obstacle {
    /// The highest penetrability of a solid component (thesis §3.2.2.1).
    pub const SOLID: f32 = 0.1;

    /// Returns true if no robot can enter the rectangle.
    #[must_use]
    pub fn is_solid(&self) -> bool {
        self.penetrability <= Self::SOLID
    }

    /// Returns true if a place, m, lies inside the rectangle and not on its edge.
    #[must_use]
    pub fn contains(&self, x_m: f32, y_m: f32) -> bool {
        let inside = |place: f32, from: f32, size: f32| from < place && place < from + size;
        inside(x_m, self.x_m, self.width_m) && inside(y_m, self.y_m, self.height_m)
    }

    /// Rejects a place, a size or a penetrability out of range.
    pub(super) fn check(&self, at: &KeyPath) -> Result<(), Problem> {
        const PLACE: NumberRange = closed(-FARTHEST_M, FARTHEST_M, "m");
        const SIZE: NumberRange = above_zero(2.0 * FARTHEST_M, "m");
        PLACE.check(at.key("x_m"), self.x_m)?;
        PLACE.check(at.key("y_m"), self.y_m)?;
        SIZE.check(at.key("width_m"), self.width_m)?;
        SIZE.check(at.key("height_m"), self.height_m)?;
        PENETRABILITY.check(at.key("penetrability"), self.penetrability)
    }
}

/// A rectangle on the floor that slows down or speeds up robots, as a scenario file states it. The scenario contains
/// the obstacle of the same effect.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Zone {
    x_m: f32,
    y_m: f32,
    width_m: f32,
    height_m: f32,
    /// The speed inside the zone, as a multiple of the speed on neutral ground, above [`Obstacle::SOLID`].
    speed_factor: f32,
}

impl Zone {
    /// Returns the obstacle of the same effect.
    ///
    /// # Errors
    /// Returns the first number of the zone out of range, below `at`.
    pub(super) fn obstacle(self, at: &KeyPath) -> Result<Obstacle, Problem> {
        let factor = above(Obstacle::SOLID.into(), PENETRABILITY.to, "");
        factor.check(at.key("speed_factor"), self.speed_factor)?;
        let obstacle = Obstacle {
            x_m: self.x_m,
            y_m: self.y_m,
            width_m: self.width_m,
            height_m: self.height_m,
            penetrability: self.speed_factor,
        };
        obstacle.check(at)?;
        Ok(obstacle)
    }
}
