//! Messages of the consensus-based auctions CBAA and CBBA (Choi, Brunet, How, IEEE T-RO 25(4):912–926, 2009), and of ACBBA (Johnson,
//! Ponda, Choi, How, AIAA 2010).
//!
//! In CBAA and CBBA a robot's beliefs go out in parts of at most [`BLOCK_TASKS`] tasks, so that a message has a bounded length however many tasks there
//! are. Each part is negotiated by itself, with times of news of its own: a part that is lost takes nothing from another.

use serde::{Deserialize, Serialize};

use crate::ids::{RobotId, TaskId};
use crate::time::SimTime;

/// Tasks of a part: those with ids from `block * BLOCK_TASKS` on.
pub const BLOCK_TASKS: u16 = 32;

/// Most robots of which a part tells the news. With as many, and all tasks of a block, a message takes less than 1,200 bytes.
pub const NEWS_MAX: usize = 64;

/// What a robot believes of one part of the tasks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Which tasks the part has; see [`BLOCK_TASKS`].
    pub block: u16,
    /// Which place of each of them; an exclusive task has only place 0.
    pub slot: u16,
    /// Of the tasks that the sender has, in ascending order: y, z, and the round.
    pub beliefs: Vec<Belief>,
    /// s: of whom the sender has news, in ascending order; without itself.
    pub news: Vec<News>,
}

/// What a robot believes of one place of one task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    /// The task.
    pub task: TaskId,
    /// Since when the task has been due, ms; what was said about an older round is void.
    pub round: SimTime,
    /// Who has it; `None`: nobody.
    pub claim: Option<Claim>,
}

/// A winning bid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// z, the winner.
    pub robot: RobotId,
    /// y, what the winner bids; finite and not negative.
    pub value: f32,
}

impl Claim {
    /// Whether it goes before another: the larger bid, of equal ones that of the lower rank.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        self.value > other.value || (self.value == other.value && self.robot < other.robot)
    }
}

/// How old the latest news of a robot is that has reached the sender, directly or by others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct News {
    /// Of whom.
    pub robot: RobotId,
    /// Its age at the time of sending, ms.
    pub age_ms: u32,
}

/// Most entries of [`Deltas`]. With as many a message takes less than 1,200 bytes.
pub const DELTAS_MAX: usize = 36;

/// What has changed in what a robot knows of bids, each by itself: what ACBBA says in the place of [`Table`]s.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deltas {
    /// At most [`DELTAS_MAX`].
    pub entries: Vec<Delta>,
}

/// The newest word about one robot's bid for one place of one task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Delta {
    /// The task, its round, and whose bid: one of 0 has been taken back. `None`: nobody has the place, and the round is all that is told.
    pub belief: Belief,
    /// Which place of the task.
    pub slot: u16,
    /// t: when that robot made the bid, or took it back.
    pub made: SimTime,
}
