//! Messages of SSI, sequential single-item auctions (Lagoudakis et al., RSS 2005).

use serde::{Deserialize, Serialize};

use scenario::ids::TaskId;
use scenario::time::SimTime;

/// The number of tasks in a block: the tasks with ids from `block * AWARD_BLOCK_TASKS` on. A message contains the
/// awards of one block and therefore takes less than 1,200 bytes.
pub const AWARD_BLOCK_TASKS: u32 = 32;

/// The sender's bid in an auction, and all tasks of one block that the sender has won.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AuctionBid {
    /// The number of the auction. Each auction awards one task.
    pub auction: u32,
    /// The bid; `None` if the sender does not bid in this auction.
    pub bid: Option<CostBid>,
    /// The number of the block; see [`AWARD_BLOCK_TASKS`].
    pub block: u32,
    /// The sender's awards in the block, in ascending order of the task. Other awards to the sender of earlier auctions
    /// are void.
    pub awards: Vec<Award>,
}

/// A bid for one place of a task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostBid {
    pub task: TaskId,
    /// The place within a task for several robots, from 0.
    pub slot: u16,
    /// The team cost of the task, s per unit of reward; finite and not negative. The lowest bid wins.
    pub cost: f32,
}

/// A place of a task that the sender has won.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Award {
    /// The time since which the task has been due, ms.
    pub round: SimTime,
    /// The number of the auction.
    pub auction: u32,
    /// The bid that won the auction.
    pub bid: CostBid,
}
