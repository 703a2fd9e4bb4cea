//! Messages of the consensus-based auctions CBAA and CBBA (Choi, Brunet, How, IEEE T-RO 25(4):912–926, 2009), and of
//! ACBBA (Johnson, Ponda, Choi, How, AIAA 2010). PI and HIPC send the same tables.
//!
//! CBAA and CBBA send their tables in blocks of at most [`BLOCK_TASKS`] tasks, which bounds the length of a message for
//! any number of tasks. Each block is negotiated separately, with its own time stamps. The loss of one block does not
//! affect the others.

use serde::{Deserialize, Serialize};

use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

/// The number of tasks in a block: the tasks with ids from `block * BLOCK_TASKS` on.
pub const BLOCK_TASKS: u32 = 32;

/// The largest number of time stamps in a block. With all of them and all tasks of a block, a message takes less than
/// 1,200 bytes, for up to 65,536 robots and tasks.
pub const TIME_STAMPS_MAX: usize = 64;

/// A robot's winning bids for one block of tasks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BidTable {
    /// The number of the block; see [`BLOCK_TASKS`].
    pub block: u32,
    /// The slot of each task that the table is about. An exclusive task has only slot 0.
    pub slot: u16,
    /// The entries of the tasks that the sender can execute, in ascending order: y, z, and the round.
    pub beliefs: Vec<TableEntry>,
    /// s: the time stamps of the other robots, in ascending order of rank.
    pub news: Vec<TimeStamp>,
}

/// A robot's entry for one slot of one task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableEntry {
    pub task: TaskId,
    /// The time since which the task has been due, ms. Entries of an older round are void.
    pub round: SimTime,
    /// The winning bid; `None` if there is no winner.
    pub claim: Option<WinningBid>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WinningBid {
    pub robot: RobotId,
    /// The bid y of the winner, finite; the larger one wins. Not negative, except in PI, where it is the negative impact
    /// −γ.
    pub value: f32,
}

impl WinningBid {
    /// Returns whether this claim wins against another one. The larger bid wins; of equal bids, the one of the lower
    /// rank wins.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        self.value > other.value || (self.value == other.value && self.robot < other.robot)
    }
}

/// The age of the latest information from a robot that has reached the sender, directly or through other robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimeStamp {
    pub robot: RobotId,
    /// The age at the time of sending, ms.
    pub age_ms: u32,
}

/// The largest number of entries of [`Deltas`]. With all of them a message takes less than 1,200 bytes.
pub const DELTAS_MAX: usize = 36;

/// Single changes of winning bids. ACBBA sends them instead of [`BidTable`]s.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deltas {
    /// The changes, at most [`DELTAS_MAX`].
    pub entries: Vec<BidChange>,
}

/// The latest information about one robot's bid for one slot of one task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BidChange {
    /// The task, its round and the bid. A bid of 0 has been withdrawn. `None` means that the slot is free and only the
    /// round is transmitted.
    pub belief: TableEntry,
    pub slot: u16,
    /// t: the time at which the robot made or withdrew the bid.
    pub made: SimTime,
}
