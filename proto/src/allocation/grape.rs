//! Messages of GRAPE (Jang, Shin, Tsourdos, IEEE T-RO 34(6), 2018).

use serde::{Deserialize, Serialize};

use crate::ids::{RobotId, TaskId};
use crate::time::SimTime;

/// Most members of a message; with as many it takes less than 1,200 bytes.
pub const MEMBERS_MAX: usize = 75;

/// Who is in which coalition, or a part of that. What a robot says of one (evolution, stamp) is the same whoever says it, but for when
/// its members gave their last sign of life.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Partition {
    /// How many decisions have led to it.
    pub evolution: u64,
    /// A random number of the robot that made the last one, in [0, 1): of as many decisions the larger stamp counts.
    pub stamp: f64,
    /// Which part this is, from 0.
    pub part: u16,
    /// How many parts there are.
    pub parts: u16,
    /// Who has a task, in ascending order; at most [`MEMBERS_MAX`].
    pub members: Vec<Member>,
}

/// A robot in the coalition of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    /// Which robot.
    pub robot: RobotId,
    /// Which task.
    pub task: TaskId,
    /// When the robot said the last word of which somebody knows.
    pub seen: SimTime,
}
