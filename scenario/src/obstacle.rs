//! Rectangles on the floor, placed by a scenario or by a fault.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
