//! Messages of DHBA, the decentralized Hungarian-based approach (Ismail, Sun, ICUAS 2017).

use serde::{Deserialize, Serialize};

use super::ble::EligibleTask;
use scenario::ids::RobotId;
use scenario::time::SimTime;

/// The largest number of entries of a row. It leaves room for the version in [`PART_WEIGHT_MAX`].
pub const ROW_ENTRIES_MAX: usize = 60;

/// The largest weight of a message: an entry counts once, a row or a version twice. With this weight, a message takes
/// less than 1,200 bytes.
pub const PART_WEIGHT_MAX: usize = 64;

/// Rows of the sender's matrix, and the versions of all rows that the sender has.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MatrixPart {
    /// Some rows of the matrix.
    pub rows: Vec<MatrixRow>,
    /// The versions of some rows, in ascending order of the robot.
    pub versions: Vec<RowVersion>,
}

/// The utilities of one robot for its tasks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MatrixRow {
    pub version: RowVersion,
    /// The entries, in descending order of utility. Entries of an older round are void.
    pub entries: Vec<EligibleTask>,
}

/// The version of a robot's row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowVersion {
    pub robot: RobotId,
    /// The time at which the robot computed the row. A later row replaces an earlier one. `None` if the sender lacks
    /// the row.
    pub made: Option<SimTime>,
    /// The time of the robot's latest message that has reached the sender, directly or through other robots.
    pub seen: SimTime,
}
