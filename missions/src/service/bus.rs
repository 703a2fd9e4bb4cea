//! What crosses the bus in a service mission.

use alliance_proto::time::SimTime;
use arrayvec::ArrayVec;
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Most points that a robot senses in a step.
pub const SENSED_MOST: usize = 7;

/// Most points that a heartbeat tells of.
pub const TOLD_MOST: usize = 20;

/// Of an open point at least so much is left, s: none is left of one that is over.
pub const LEAST_LEFT_S: f32 = 0.001;

/// What there is to know of a point at some time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact {
    /// Its number.
    pub point: u16,
    /// What there is to do, by the place of the kind.
    pub kind: u8,
    /// How often it has come back.
    pub round: u16,
    /// Where, m: in the room, or in the robot's frame where it is seen.
    pub at: Vec2,
    /// Work left for a robot of skill 1, s; 0: it is over, done or expired.
    pub left_s: f32,
}

/// What the devices of a robot tell. By default, nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sensed {
    /// What is new on the board, oldest first, or the points in sight, nearest first; `None`: the device is dead.
    pub points: Option<ArrayVec<Fact, SENSED_MOST>>,
    /// Up to where the board has been told with that, if it is farther than what the robot has [read](Deed::read).
    pub told: Option<u32>,
    /// The point from which the robot has taken work off in the step before.
    pub effect: Option<u16>,
}

/// What a robot does beside driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deed {
    /// It works on that point.
    pub work: Option<u16>,
    /// Up to where it has read the board: that need not be told again.
    pub read: Option<u32>,
}

/// A fact, and when somebody sensed it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// In the room's frame.
    pub fact: Fact,
    /// Of two facts about the same round of a point, the newer one holds.
    pub sensed: SimTime,
}

/// What a robot tells with each heartbeat.
pub type Told = ArrayVec<Known, TOLD_MOST>;
