//! The messages of MURDOCH.

use serde::{Deserialize, Serialize};

use crate::ids::{Incarnation, RobotId, TaskId};
use crate::time::SimTime;

/// A word in an auction, or about the contract that came of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Negotiation {
    /// What is auctioned.
    pub task: TaskId,
    /// Since when the task has been due again, as far as the sender knows.
    pub round: SimTime,
    /// Which auction.
    pub auction: AuctionId,
    /// The word.
    pub word: Word,
}

/// An auction, told from all others of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AuctionId {
    /// Who opened it.
    pub auctioneer: RobotId,
    /// In which of its incarnations.
    pub incarnation: Incarnation,
    /// Running number within that.
    pub number: u32,
}

/// What is said.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Word {
    /// The auctioneer: the task is to be had.
    Announce {
        /// Bids count until then.
        closes: SimTime,
    },
    /// A free robot that could do it: this is what a unit by me is worth.
    Bid {
        /// Its utility.
        utility: f32,
    },
    /// The auctioneer, again and again: this robot has it. The first one is the award.
    Renew {
        /// Who has it.
        winner: RobotId,
    },
    /// Who has it.
    Ack {
        /// Whether it goes on.
        status: Status,
        /// Effects that it has achieved on the task since it began.
        progress: u32,
    },
}

/// How a contract stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// At work.
    Ongoing,
    /// There is no more to do.
    Done,
    /// Given back, or not taken.
    Abort,
}
