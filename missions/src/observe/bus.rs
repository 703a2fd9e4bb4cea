//! What crosses the bus in an observe mission.

use alliance_proto::time::SimTime;
use arrayvec::ArrayVec;
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Most targets that a robot senses in a step, and that a heartbeat tells of.
pub const SENSED_MOST: usize = 12;

/// A target in range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Its number.
    pub target: u16,
    /// Where, in the robot's frame, m.
    pub offset: Vec2,
}

/// What the devices of a robot tell. By default, nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sensed {
    /// The targets in range, nearest first; `None`: the device is dead.
    pub targets: Option<ArrayVec<Seen, SENSED_MOST>>,
}

/// What a robot does beside driving: it has looked, with a device that works. What is in its range is observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Watch;

/// Where a target was when somebody sensed it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// Its number.
    pub target: u16,
    /// Where, in the room, m.
    pub at: Vec2,
    /// When.
    pub when: SimTime,
}

/// What a robot tells with each heartbeat: the targets that it has in sight.
pub type Told = ArrayVec<Sighting, SENSED_MOST>;
