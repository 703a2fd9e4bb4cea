//! What the clean-up leaves in mission.csv and run.json.

use super::ItemCounts;
use alliance_proto::log::{Table, TableRow};
use alliance_proto::mission::{MissionFigures, Value};
use alliance_proto::time::SimTime;
use serde::Deserialize;

/// Name of a column.
pub const LAST_REPORT: &str = "last_report_ms";
/// Name of a figure.
pub const REPORTS_MADE: &str = "reports_made";
/// Name of a figure.
pub const ITEMS_DELIVERED: &str = "items_delivered";
/// Name of a figure.
pub const LATENESS_MEAN_MS: &str = "report_lateness_mean_ms";
/// Name of a figure.
pub const LATENESS_MAX_MS: &str = "report_lateness_max_ms";

/// A row of mission.csv.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // The columns of DESIGN §8.
pub struct WasteRow {
    pub t_ms: SimTime,
    pub items_in_spills: u32,
    pub items_carried: u32,
    pub items_on_floor: u32,
    pub items_delivered: u32,
    pub last_report_ms: Option<SimTime>,
}

impl TableRow for WasteRow {
    const TABLE: Table = Table::Mission;
}

/// What run.json tells of the clean-up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WasteFigures {
    /// Where the items were at the end.
    pub items: ItemCounts,
    /// Progress reports made.
    pub reports_made: u32,
    /// How much later than the wanted period after the report before it, or after the start, a report came: the mean over
    /// all reports, ms; `None` without reports. Early ones count as 0.
    pub report_lateness_mean_ms: Option<f64>,
    /// The same of the latest one.
    pub report_lateness_max_ms: Option<u64>,
}

impl WasteFigures {
    /// Those among a run's figures; zeros in a run of another mission.
    #[must_use]
    pub fn of(figures: &MissionFigures) -> Self {
        let count = |name| figures.count(name) as u32;
        Self {
            items: ItemCounts {
                in_spills: count("items.in_spills"),
                carried: count("items.carried"),
                on_floor: count("items.on_floor"),
                delivered: count("items.delivered"),
            },
            reports_made: count(REPORTS_MADE),
            report_lateness_mean_ms: match figures.get(LATENESS_MEAN_MS) {
                Value::Real(mean) => Some(mean),
                _ => None,
            },
            report_lateness_max_ms: match figures.get(LATENESS_MAX_MS) {
                Value::Count(most) => Some(most),
                _ => None,
            },
        }
    }
}
