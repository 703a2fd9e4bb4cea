//! The data types of service that cross the bus.

use arrayvec::ArrayVec;
use glam::Vec2;
use scenario::time::SimTime;
use serde::{Deserialize, Serialize};

pub const MAX_SENSED: usize = 7;

pub const MAX_SHARED: usize = 20;

/// The minimum work left of an open point, s. Less would mean that the point is over.
pub const LEAST_LEFT_S: f32 = 0.001;

/// The work left that stands for a load on its way, s. Less than any robot estimates before the pick-up.
pub const LOAD_LEFT_S: f32 = LEAST_LEFT_S / 2.0;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointFact {
    pub point: u32,
    /// The kind of work, as an index into the scenario's kinds.
    pub kind: u32,
    pub round: u32,
    /// The place, m: in the robot's frame in a reading of sight, in the room's frame elsewhere.
    pub at: Vec2,
    /// The work left for a robot of skill 1, s. 0 if the point is done or expired.
    pub left_s: f32,
}

/// The readings of a robot's devices. Empty by default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorReading {
    /// New board entries, oldest first, or visible points, nearest first. `None` if the device is dead.
    pub points: Option<ArrayVec<PointFact, MAX_SENSED>>,
    /// The last board line covered by `points`, if it is beyond the line that the robot has [acknowledged](Action::read).
    pub board_line: Option<u32>,
    /// The point on which the robot worked successfully in the previous step.
    pub effect: Option<u32>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Action {
    pub work: Option<u32>,
    /// The last board line that the robot has read. The board does not repeat lines up to this one.
    pub read: Option<u32>,
}

/// A fact, with the time of the observation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservedFact {
    /// The fact, in the room's frame.
    pub fact: PointFact,
    /// The time of the observation. Of two facts about the same round of a point, the newer one holds.
    pub sensed: SimTime,
}

/// The shared knowledge in a heartbeat.
pub type SharedKnowledge = ArrayVec<ObservedFact, MAX_SHARED>;
