//! What lies on the floor, of a scenario and by a fault.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rectangle on the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Lower left corner, m.
    pub x_m: f32,
    /// Lower left corner, m.
    pub y_m: f32,
    /// Extent in x, m.
    pub width_m: f32,
    /// Extent in y, m.
    pub height_m: f32,
    /// [0, 0.1] solid, (0.1, 1) slows by that factor, 1 neutral, above 1 speeds up (thesis §3.2.2.1).
    #[serde(default)]
    pub penetrability: f32,
}
