//! The messages of the MURDOCH allocator.

use serde::{Deserialize, Serialize};

use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

/// A message of an auction, or about the contract that resulted from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Negotiation {
    pub task: TaskId,
    /// The time since which the task has been due again, according to the sender.
    pub round: SimTime,
    pub auction: AuctionId,
    pub word: NegotiationKind,
}

/// The identification of an auction, unique within a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AuctionId {
    pub auctioneer: RobotId,
    pub incarnation: Incarnation,
    pub number: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum NegotiationKind {
    /// The auctioneer offers the task.
    Announce {
        /// The time until which bids count.
        closes: SimTime,
    },
    /// A free robot that can do the task bids.
    Bid { utility: f32 },
    /// The auctioneer confirms the winner repeatedly. The first confirmation is the award.
    Renew { winner: RobotId },
    /// The winner acknowledges the contract.
    Ack {
        status: ContractStatus,
        /// The number of effects on the task since the winner started it.
        progress: u32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ContractStatus {
    /// The winner works on the task.
    Ongoing,
    /// The task has no more work.
    Done,
    /// The winner returned or rejected the contract.
    Abort,
}
