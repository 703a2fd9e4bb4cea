//! Messages of GRAPE (Jang, Shin, Tsourdos, IEEE T-RO 34(6), 2018).

use serde::{Deserialize, Serialize};

use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

/// The largest number of members in a message. With all of them it takes less than 1,200 bytes.
pub const MEMBERS_MAX: usize = 75;

/// A partition of the robots into coalitions, or a part of it. All robots send the same contents for a pair of
/// evolution and stamp, except for the `seen` times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CoalitionPartition {
    /// The number of decisions that led to the partition.
    pub evolution: u64,
    /// A random number in [0, 1) of the robot that made the last decision. Of two partitions with the same evolution,
    /// the one with the larger stamp wins.
    pub stamp: f64,
    /// The number of this part, from 0.
    pub part: u16,
    /// The number of parts.
    pub parts: u16,
    /// The robots with a task, in ascending order; at most [`MEMBERS_MAX`].
    pub members: Vec<CoalitionMember>,
}

/// A robot in the coalition of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CoalitionMember {
    pub robot: RobotId,
    pub task: TaskId,
    /// The time of the latest message of the robot that any robot reported.
    pub seen: SimTime,
}
