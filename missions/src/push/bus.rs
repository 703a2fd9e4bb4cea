//! What crosses the bus in a push mission. Robots do nothing beside driving.

use alliance_proto::readings::Pose;
use alliance_proto::time::SimTime;
use arrayvec::ArrayVec;
use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::bar::End;

/// Most bars that a heartbeat tells of.
pub const TOLD_MOST: usize = 4;

/// What the devices of a robot tell. By default, nothing: both are dead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sensed {
    /// The nearest bar in sight; `None`: the device is dead.
    pub bar: Option<Option<BarSeen>>,
    /// Whether the hull touches a bar; `None`: the device is dead.
    pub touch: Option<bool>,
}

/// A bar that a robot sees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BarSeen {
    /// Its number.
    pub bar: u16,
    /// The end that is nearer.
    pub end: End,
    /// Where that end is, in the robot's frame, m.
    pub near_end: Vec2,
    /// How far the bar's left end is ahead of its right one toward the goal, m.
    pub lead_m: f32,
}

/// A stroke that is done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stroke {
    /// At which end.
    pub end: End,
    /// When.
    pub at: SimTime,
}

/// What a robot tells of a bar.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Its number.
    pub bar: u16,
    /// Where it was, m.
    pub pose: Pose,
    /// When it was seen there.
    pub seen: SimTime,
    /// The last stroke.
    pub last: Option<Stroke>,
}

/// What a robot tells with each heartbeat.
pub type Lore = ArrayVec<Told, TOLD_MOST>;

/// No deed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Deed {}
