//! How much of a run is written down.

use serde::{Deserialize, Serialize};

use super::table::Table;

/// `--log` (DESIGN §8). The run and its hash are the same at every level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogLevel {
    /// Every table, every tick.
    #[default]
    Full,
    /// Events, mission and inputs; ticks.csv with one seal per second of simulated time instead of all hashes.
    Summary,
    /// Inputs only.
    Off,
}

impl LogLevel {
    /// All, the one that keeps most first.
    pub const ALL: [Self; 3] = [Self::Full, Self::Summary, Self::Off];

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
                Table::Events | Table::Mission | Table::Inputs | Table::Ticks
            ),
            Self::Off => table == Table::Inputs,
        }
    }
}
