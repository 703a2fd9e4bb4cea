//! The one message of BLE.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use super::few;
use crate::ids::TaskId;
use crate::time::SimTime;

/// Most entries of an [`Eligibility`]: with their longest encoding they stay below
/// [`OPEN_MESSAGE_MAX`](super::OPEN_MESSAGE_MAX).
pub const ELIGIBLE_MAX: usize = 64;

/// How eligible the sender is for each task that it could begin now.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Eligibility {
    /// At most [`ELIGIBLE_MAX`], the best first.
    #[serde(with = "few")]
    pub entries: SmallVec<[Eligible; 6]>,
}

/// How eligible a robot is for a task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Eligible {
    /// The task.
    pub task: TaskId,
    /// Since when the task has been due again, as far as the sender knows.
    pub round: SimTime,
    /// The sender's utility for a unit of it.
    pub utility: f32,
}
