//! The messages of an observe mission.

use arrayvec::ArrayVec;
use glam::Vec2;
use scenario::time::SimTime;
use serde::{Deserialize, Serialize};

/// The largest number of targets in a sensor reading, and in a heartbeat.
pub const MAX_SENSED_TARGETS: usize = 12;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensedTarget {
    pub target: u32,
    /// The position of the target in the robot's frame, m.
    pub offset: Vec2,
}

/// The readings of a robot's devices. The default is a dead device.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorReading {
    /// The targets in range, nearest first; `None` for a dead device.
    pub targets: Option<ArrayVec<SensedTarget, MAX_SENSED_TARGETS>>,
}

/// The action of a robot with a working device: it observes all targets in its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ObserveAction;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    pub target: u32,
    /// The position in the room, m.
    pub at: Vec2,
    pub when: SimTime,
}

/// The shared knowledge in each heartbeat: the targets in the robot's sight.
pub type SharedSightings = ArrayVec<Sighting, MAX_SENSED_TARGETS>;
