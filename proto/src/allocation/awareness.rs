//! Messages of HIPC (Johnson, Choi, How 2012): the state of a robot from which its teammates predict its plan. The plans
//! themselves are [`consensus`](super::consensus) tables.

use serde::{Deserialize, Serialize};

use scenario::ids::TaskId;

/// A robot's costs for one block of tasks ([`BLOCK_TASKS`](super::consensus::BLOCK_TASKS)). With all tasks of a block, a
/// message takes less than 1,200 bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Awareness {
    /// The number of the block.
    pub block: u32,
    /// The tasks that the sender can execute now, in ascending order.
    pub costs: Vec<TaskCost>,
}

/// The value of one task for the sender.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskCost {
    pub task: TaskId,
    /// The estimated duration of one unit of work as the next one, s; finite.
    pub cost_s: f64,
    /// The utility as the next unit; finite.
    pub worth: f64,
}
