//! The sensor readings and the actuation of a robot: the only interface between its controller and its body.
//!
//! Lengths are in metres, angles in radians counter-clockwise from x, speeds in m/s and rad/s. In the robot's own frame
//! x points ahead and y to the left.

use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mission::{Action, SensorReading};

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pose {
    /// The position of the centre, m.
    #[schemars(with = "[f32; 2]")]
    pub position: Vec2,
    /// The heading in (-π, π], rad counter-clockwise from x.
    pub heading_rad: f32,
}

/// A solid object within the range of one beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Hit {
    /// The free distance along the beam, m; 0 is contact. It counts from the line at right angles to the beam that touches
    /// the body, one radius from its center. For the center beam this is the robot's edge; for the outer beams, the edge
    /// is up to one radius behind the line.
    pub distance_m: f32,
    /// The direction of the outward surface normal at the hit, in the robot's frame, rad in (-π, π].
    pub normal_rad: f32,
}

/// The collision-avoidance sensor (thesis Fig. 4.5 and 4.6). It detects solid objects ahead and beside the robot,
/// including the border. `None` is a free beam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Proximity {
    /// The beams ahead: left, center, right. The outer beams run parallel to the heading at the sides of the body. The
    /// center beam is as wide as the body: it is free exactly if the robot can move ahead by its length.
    pub ahead: [Option<Hit>; 3],
    /// The beams at right angles to the heading, from the front, center and rear of the body.
    pub left: [Option<Hit>; 3],
    pub right: [Option<Hit>; 3],
}

/// The penetrability of the ground: 1 is neutral, smaller values slow the robot down, larger values speed it up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ground {
    /// The value under the robot's center.
    pub here: f32,
    /// The value one body radius beyond the robot's front.
    pub ahead: f32,
}

/// The sensor values of one step. A device is `None` if the robot lacks it or if it is dead.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Readings {
    pub pose: Option<Pose>,
    /// The distance from the robot's edge to the border straight ahead, m; `Some(None)` beyond the sensor's range.
    pub front_border: Option<Option<f32>>,
    /// The distance to the border on the left side. Only robots with a side sensor have it.
    pub side_border: Option<Option<f32>>,
    pub proximity: Option<Proximity>,
    pub ground: Option<Ground>,
    /// The remaining energy, J; `None` if energy is not simulated.
    pub energy_j: Option<f32>,
    /// The readings of the mission's own devices.
    #[schemars(with = "serde_json::Value")]
    pub mission: SensorReading,
}

/// The commands of one step. A robot first turns and then moves straight ahead, both within its limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Actuation {
    /// The forward speed, m/s. Negative values count as 0: robots do not reverse.
    pub speed_m_s: f32,
    /// The turn rate, rad/s; positive is counter-clockwise.
    pub turn_rad_s: f32,
    pub action: Action,
}
