//! Messages of DHBA, the decentralized Hungarian-based approach (Ismail, Sun, ICUAS 2017).

use serde::{Deserialize, Serialize};

use super::ble::EligibleTask;
use crate::codec::number_len;
use scenario::ids::RobotId;
use scenario::time::SimTime;

/// The largest number of entries of a row. A row with as many fits in a message at any time.
pub const ROW_ENTRIES_MAX: usize = 60;

/// The largest sizes of the parts of a message in which no time is later than a given one, bytes.
#[derive(Clone, Copy, Debug)]
pub struct PartSizes {
    /// The size of an entry.
    pub entry: usize,
    /// The size of a row without its entries.
    pub row: usize,
    /// The size of a version.
    pub version: usize,
}

impl PartSizes {
    /// The largest size of a message's rows and versions, so that the message takes at most 1,200 bytes.
    pub const MAX: usize = 1_190;

    /// Returns the sizes at a time.
    pub fn at(now: SimTime) -> Self {
        let (id, time) = (number_len(u32::MAX.into()), number_len(now.0));
        let version = id + (1 + time) + time;
        Self {
            entry: id + time + size_of::<f32>(),
            row: version + 1,
            version,
        }
    }
}

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
