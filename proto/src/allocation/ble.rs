//! The message of the BLE allocator.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use super::short_list;
use scenario::ids::TaskId;
use scenario::time::SimTime;

/// The largest number of entries of an [`Eligibility`]. With the longest encoding of each entry, the message is smaller
/// than [`OPEN_MESSAGE_MAX`](super::OPEN_MESSAGE_MAX).
pub const ELIGIBLE_MAX: usize = 64;

/// The sender's eligibility for each task that it can start now.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Eligibility {
    /// The entries in descending order of utility, at most [`ELIGIBLE_MAX`].
    #[serde(with = "short_list")]
    pub entries: SmallVec<[EligibleTask; 6]>,
}

/// The eligibility of a robot for a task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EligibleTask {
    pub task: TaskId,
    /// The time since which the task has been due again, according to the sender.
    pub round: SimTime,
    /// The sender's utility for one unit of the task.
    pub utility: f32,
}
