//! The messages of a push mission. Robots have no action beside driving.

use arrayvec::ArrayVec;
use glam::Vec2;
use proto::readings::Pose;
use scenario::time::SimTime;
use serde::{Deserialize, Serialize};

use super::bar::BarEnd;

/// The largest number of bars in a heartbeat.
pub const MAX_REPORTED_BARS: usize = 4;

/// The readings of a robot's devices. By default both devices are dead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorReading {
    /// The nearest bar in sight; `None` for a dead device.
    pub bar: Option<Option<BarSeen>>,
    /// True if the hull touches a bar; `None` for a dead device.
    pub touch: Option<bool>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BarSeen {
    pub bar: u32,
    pub end: BarEnd,
    /// The position of that end in the robot's frame, m.
    pub near_end: Vec2,
    /// The lead of the bar's left end over the right one toward the goal, m.
    pub lead_m: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stroke {
    pub end: BarEnd,
    pub at: SimTime,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BarReport {
    pub bar: u32,
    /// The last known pose, m and rad.
    pub pose: Pose,
    /// The time at which the bar was seen there.
    pub seen: SimTime,
    pub last: Option<Stroke>,
}

/// The shared knowledge in each heartbeat.
pub type SharedKnowledge = ArrayVec<BarReport, MAX_REPORTED_BARS>;
