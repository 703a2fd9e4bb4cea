//! How much of a run is written down.

use serde::{Deserialize, Serialize};

use super::table::Table;

/// `--log` (DESIGN §8). The run and its hash are the same at every level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogLevel {
    /// Every table, every tick.
    Full,
    /// Events, mission and inputs; ticks.csv with one seal per second of simulated time instead of all hashes.
    Summary,
    /// Inputs only, and the answers of foreign minds.
    Off,
}

impl LogLevel {
    /// All, the one that keeps most first.
    pub const ALL: [Self; 3] = [Self::Full, Self::Summary, Self::Off];

    /// What is written where nobody says how much: a full log has a row per behavior set and tick, which fills gigabytes in minutes where
    /// a team has more of them than [`Self::SETS_IN_FULL`].
    #[must_use]
    pub fn of_a_team(behavior_sets: usize) -> Self {
        if behavior_sets > Self::SETS_IN_FULL {
            Self::Summary
        } else {
            Self::Full
        }
    }

    /// Behavior sets of all robots together of which a full log is written unasked: with 25 bytes a row, 1 MB per second of simulated time.
    pub const SETS_IN_FULL: usize = 2_000;

    /// As written on the command line.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Summary => "summary",
            Self::Off => "off",
        }
    }

    /// Whether the table is written.
    #[must_use]
    pub fn keeps(self, table: Table) -> bool {
        match self {
            Self::Full => true,
            Self::Summary => matches!(
                table,
                Table::Events | Table::Mission | Table::Inputs | Table::Foreign | Table::Ticks
            ),
            // From these the run can be made again.
            Self::Off => matches!(table, Table::Inputs | Table::Foreign),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_says_nothing_gets_a_full_log_of_few_and_a_summary_of_many() {
        assert_eq!(LogLevel::of_a_team(2_000), LogLevel::Full);
        assert_eq!(LogLevel::of_a_team(2_001), LogLevel::Summary);
    }
}
