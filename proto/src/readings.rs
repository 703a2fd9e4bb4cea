//! What a robot senses and what it can do: the only things that pass between its mind and its body (DESIGN §7).
//!
//! Lengths in metres, angles in radians counter-clockwise from x, speeds in m/s and rad/s. In the robot's own frame x is
//! ahead and y is to the left.

use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mission::{Deed, Sensed};

/// Where a body is and where it faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pose {
    /// Centre, m.
    #[schemars(with = "[f32; 2]")]
    pub position: Vec2,
    /// Heading in (-π, π], rad counter-clockwise from x.
    pub heading_rad: f32,
}

/// A solid within range of one beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Hit {
    /// Free way along the beam, counted from the robot's edge, m; 0 is contact.
    pub distance_m: f32,
    /// Direction of the outward surface normal at the hit, in the robot's frame, rad in (-π, π].
    pub normal_rad: f32,
}

/// The collision-avoidance sensor (thesis Fig. 4.5 and 4.6): what is solid ahead and beside the robot, the border included.
/// `None` is a free beam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Proximity {
    /// Ahead: left, center, right. The outer beams run parallel to the heading at the sides of the body; the center one is as
    /// wide as the body, so that it is free exactly when the robot can move ahead by its length.
    pub ahead: [Option<Hit>; 3],
    /// To the left: beams at right angles to the heading from the front, the center and the rear of the body.
    pub left: [Option<Hit>; 3],
    /// The same to the right.
    pub right: [Option<Hit>; 3],
}

/// Penetrability of the ground (DESIGN §7): 1 is neutral, less slows down, more speeds up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ground {
    /// Under the robot's center.
    pub here: f32,
    /// One body radius beyond its front.
    pub ahead: f32,
}

/// One step's sensor values. Each device is `None` when the robot lacks it or when it is dead.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Readings {
    /// Position sensor.
    pub pose: Option<Pose>,
    /// Distance from the robot's edge to the border straight ahead, m, `Some(None)` beyond the sensor's range.
    pub front_border: Option<Option<f32>>,
    /// The same to the left side; only robots built with a side sensor have it.
    pub side_border: Option<Option<f32>>,
    /// Collision avoidance.
    pub proximity: Option<Proximity>,
    /// Ground sensor.
    pub ground: Option<Ground>,
    /// Energy left, J; `None` where energy is not simulated.
    pub energy_j: Option<f32>,
    /// What the mission's own devices tell.
    #[schemars(with = "serde_json::Value")]
    pub mission: Sensed,
}

/// One step's commands. A robot turns first and then moves straight ahead, both within its limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Actuation {
    /// Forward speed, m/s; negative values count as 0: robots do not reverse.
    pub speed_m_s: f32,
    /// Turn rate, rad/s, positive is counter-clockwise.
    pub turn_rad_s: f32,
    /// What it does beside driving.
    pub deed: Deed,
}
