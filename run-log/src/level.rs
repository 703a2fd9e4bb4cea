//! Log levels: the tables that a run writes.

use serde::{Deserialize, Serialize};

use super::table::Table;

/// The value of `--log`. The run and its hash do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogLevel {
    /// Complete tables with a row for every tick, and a hash for each section of a tick.
    Full,
    /// The same tables without the rows that follow from earlier rows ([`super::compact`]). ticks.csv has one hash per
    /// tick.
    Compact,
    /// Events, mission and inputs. ticks.csv has one seal per second of simulated time instead of all hashes.
    Summary,
    /// Inputs and the answers of external controllers only.
    Off,
}

impl LogLevel {
    /// The levels, from the most to the least data.
    pub const ALL: [Self; 4] = [Self::Full, Self::Compact, Self::Summary, Self::Off];

    /// Returns the default level. Poses and utilities of moving robots change in every tick, so a compact log of a team
    /// above [`Self::COMPACT_LOG_SETS_MAX`] can fill gigabytes.
    #[must_use]
    pub fn default_for(behavior_sets: usize) -> Self {
        if behavior_sets > Self::COMPACT_LOG_SETS_MAX {
            Self::Summary
        } else {
            Self::Compact
        }
    }

    /// The largest number of behavior sets in the team for which the default is a compact log. If every row changes, at
    /// 25 bytes a row, the log then grows by 1 MB per second of simulated time.
    pub const COMPACT_LOG_SETS_MAX: usize = 2_000;

    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Compact => "compact",
            Self::Summary => "summary",
            Self::Off => "off",
        }
    }

    /// Returns whether the log contains every value of every tick, written or recoverable.
    #[must_use]
    pub fn has_every_tick(self) -> bool {
        matches!(self, Self::Full | Self::Compact)
    }

    #[must_use]
    pub fn keeps(self, table: Table) -> bool {
        match self {
            Self::Full | Self::Compact => true,
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
    fn the_default_level_is_compact_for_small_teams_and_summary_for_large_ones() {
        assert_eq!(LogLevel::default_for(2_000), LogLevel::Compact);
        assert_eq!(LogLevel::default_for(2_001), LogLevel::Summary);
    }
}
