//! Log levels: the tables that a run writes.

use serde::{Deserialize, Serialize};

use super::table::Table;

/// The value of `--log`. The run and its hash do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogLevel {
    /// Complete tables, with a row for every tick.
    Full,
    /// Events, mission and inputs. ticks.csv has one seal per second of simulated time instead of all hashes.
    Summary,
    /// Inputs and the answers of external controllers only.
    Off,
}

impl LogLevel {
    /// The levels, from the most to the least data.
    pub const ALL: [Self; 3] = [Self::Full, Self::Summary, Self::Off];

    /// Returns the default level. A full log has a row per behavior set and tick, which fills gigabytes within minutes
    /// for teams above [`Self::FULL_LOG_SETS_MAX`].
    #[must_use]
    pub fn default_for(behavior_sets: usize) -> Self {
        if behavior_sets > Self::FULL_LOG_SETS_MAX {
            Self::Summary
        } else {
            Self::Full
        }
    }

    /// The largest number of behavior sets in the team for which the default is a full log. At 25 bytes a row, the log
    /// then grows by 1 MB per second of simulated time.
    pub const FULL_LOG_SETS_MAX: usize = 2_000;

    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Summary => "summary",
            Self::Off => "off",
        }
    }

    #[must_use]
    pub fn keeps(self, table: Table) -> bool {
        match self {
            Self::Full => true,
            Self::Summary => matches!(
                table,
                Table::Events | Table::Mission | Table::Inputs | Table::External | Table::Ticks
            ),
            // These tables are enough to replay the run.
            Self::Off => matches!(table, Table::Inputs | Table::External),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_level_is_full_for_small_teams_and_summary_for_large_ones() {
        assert_eq!(LogLevel::default_for(2_000), LogLevel::Full);
        assert_eq!(LogLevel::default_for(2_001), LogLevel::Summary);
    }
}
