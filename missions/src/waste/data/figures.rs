//! The clean-up's columns of mission.csv and figures of run.json, and item counts by kind of place.

use run_log::{Table, TableRow};
use scenario::mission::{FigureValue, MissionFigures};
use scenario::time::SimTime;
use serde::Deserialize;

pub const LAST_REPORT: &str = "last_report_ms";
pub const REPORTS_MADE: &str = "reports_made";
pub const ITEMS_DELIVERED: &str = "items_delivered";
pub const ITEMS_PER_HOUR: &str = "items_per_hour";
pub const LATENESS_MEAN_MS: &str = "report_lateness_mean_ms";
pub const LATENESS_MAX_MS: &str = "report_lateness_max_ms";

#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // The fields are the columns of mission.csv.
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

/// The clean-up's figures of run.json.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WasteFigures {
    pub items: ItemCounts,
    pub reports_made: u32,
    /// The mean lateness of all reports, ms. `None` without reports. Lateness is the time since the previous report, or
    /// the start, beyond the report period. Early reports count as 0.
    pub report_lateness_mean_ms: Option<f64>,
    pub report_lateness_max_ms: Option<u64>,
}

impl WasteFigures {
    /// Reads the clean-up's figures from a run's figures. Returns zeros for a run of another mission.
    #[must_use]
    pub fn from_figures(figures: &MissionFigures) -> Self {
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
                FigureValue::Real(mean) => Some(mean),
                _ => None,
            },
            report_lateness_max_ms: match figures.get(LATENESS_MAX_MS) {
                FigureValue::Count(most) => Some(most),
                _ => None,
            },
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ItemCounts {
    /// Items inside an initial spill.
    pub in_spills: u32,
    pub carried: u32,
    pub on_floor: u32,
    pub delivered: u32,
}

impl ItemCounts {
    /// Returns the number of all items. It is constant, except that the fault `waste` adds items.
    #[must_use]
    pub fn total(&self) -> u32 {
        self.in_spills + self.carried + self.on_floor + self.delivered
    }
}
