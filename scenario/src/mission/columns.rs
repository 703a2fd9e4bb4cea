//! The columns of mission.csv that a mission declares, and the mission's progress as text.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FigureValue;

/// The suffix of columns and figures that hold a time.
const MILLISECONDS: &str = "_ms";

/// The units of other figures, by the suffixes of their names.
const UNITS: [(&str, &str); 3] = [("_s", " s"), ("_m", " m"), ("_j", " J")];

/// A column of mission.csv after the time column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Column {
    /// The name in the header of mission.csv.
    pub name: &'static str,
    /// The meaning of the column's values.
    pub kind: ColumnKind,
    /// The kind of the events that change the column. They count as effects on the world. A [time](ColumnKind::Time)
    /// column holds the time of the latest one.
    pub event: Option<&'static str>,
    /// The label on the page; `None` for the name without its unit.
    pub label: Option<&'static str>,
}

/// The meaning of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ColumnKind {
    /// A count of finished work: the progress of the mission.
    Done,
    /// A count of unfinished work, in any state.
    Left,
    /// A count of anything else.
    Count,
    /// The simulated time of the latest occurrence of a repeated event, ms; none before the first.
    Time,
    /// A number that is not a count.
    Real,
    /// A count of work that expired before it was finished. A run with such work is not complete.
    Expired,
}

impl Column {
    /// Creates a column that counts finished work, one unit per event of this kind.
    #[must_use]
    pub const fn done(name: &'static str, event: &'static str) -> Self {
        Self::new(name, ColumnKind::Done, Some(event))
    }

    /// Creates a column that counts unfinished work.
    #[must_use]
    pub const fn left(name: &'static str) -> Self {
        Self::new(name, ColumnKind::Left, None)
    }

    /// Creates a column that counts work that expired before it was finished.
    #[must_use]
    pub const fn expired(name: &'static str) -> Self {
        Self::new(name, ColumnKind::Expired, None)
    }

    /// Creates a column that counts something else.
    #[must_use]
    pub const fn count(name: &'static str) -> Self {
        Self::new(name, ColumnKind::Count, None)
    }

    /// Creates a column with the time of the latest event of this kind, ms.
    #[must_use]
    pub const fn time(name: &'static str, event: &'static str) -> Self {
        Self::new(name, ColumnKind::Time, Some(event))
    }

    /// Creates a column of real numbers.
    #[must_use]
    pub const fn real(name: &'static str) -> Self {
        Self::new(name, ColumnKind::Real, None)
    }

    const fn new(name: &'static str, kind: ColumnKind, event: Option<&'static str>) -> Self {
        Self {
            name,
            kind,
            event,
            label: None,
        }
    }

    /// Returns the column with a label for the page, if its name alone does not say enough.
    #[must_use]
    pub const fn with_label(self, label: &'static str) -> Self {
        Self {
            label: Some(label),
            ..self
        }
    }

    /// Returns the column with its value in a row.
    #[must_use]
    pub fn with_value(&self, value: FigureValue) -> ColumnValue {
        ColumnValue {
            name: self.name.to_owned(),
            kind: self.kind,
            value,
        }
    }

    /// Returns the column with a number from a view.
    #[must_use]
    pub fn with_number(&self, number: Option<f64>) -> ColumnValue {
        let value = match self.kind {
            ColumnKind::Real => number.into(),
            _ => number.map(|number| number as u64).into(),
        };
        self.with_value(value)
    }
}

/// Returns the display name of a column or a figure. The suffix of a time is omitted: `last_report_ms` becomes `last
/// report`.
#[must_use]
pub fn display_name(name: &str) -> String {
    let name = name.strip_suffix(MILLISECONDS).unwrap_or(name);
    name.replace(['_', '.'], " ")
}

/// Formats a column or a figure with its value: `items carried 1`, `last report 61.2 s`, `energy used 5.00 J`.
#[must_use]
pub fn format_value(name: &str, value: FigureValue) -> String {
    let with_unit = |(suffix, unit)| Some((name.strip_suffix(suffix)?, unit));
    let (name, unit) = UNITS.into_iter().find_map(with_unit).unwrap_or((name, ""));
    let label = display_name(name);
    let Some(number) = value.number() else {
        return format!("{label} –");
    };
    match value {
        _ if name.ends_with(MILLISECONDS) => format!("{label} {:.1} s", number / 1000.0),
        FigureValue::Real(_) => format!("{label} {number:.2}{unit}"),
        _ => format!("{label} {number}{unit}"),
    }
}

/// The value of a column at some time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColumnValue {
    /// The column's name in mission.csv.
    pub name: String,
    /// The meaning of the value.
    pub kind: ColumnKind,
    /// The value in the latest row; `null` if there is none.
    pub value: FigureValue,
}

/// Formats the value with [`format_value`].
impl fmt::Display for ColumnValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&format_value(&self.name, self.value))
    }
}

/// The progress of a mission that counts finished work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The amount of finished work.
    pub done: u64,
    /// The amount of unfinished work.
    pub left: u64,
    /// The amount of work that expired before it was finished; `None` if no work can expire.
    pub expired: Option<u64>,
    /// The counted things and the work on them, such as `items delivered`.
    pub label: String,
}

impl Progress {
    /// Returns the progress in a row, or `None` if no column counts finished work.
    #[must_use]
    pub fn from_row(row: &[ColumnValue]) -> Option<Self> {
        let first = |kind| row.iter().find(|column| column.kind == kind);
        let sum = |kind| {
            let of_kind = row.iter().filter(|column| column.kind == kind);
            of_kind.map(|column| column.value.count()).sum::<u64>()
        };
        Some(Self {
            done: sum(ColumnKind::Done),
            left: sum(ColumnKind::Left),
            expired: first(ColumnKind::Expired).map(|_| sum(ColumnKind::Expired)),
            label: display_name(&first(ColumnKind::Done)?.name),
        })
    }

    /// Returns the amount of all work so far: finished, unfinished and expired.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.done + self.left + self.expired.unwrap_or(0)
    }
}

/// Formats the progress, such as `3 of 24 items delivered`. Work that can expire may also come back, so its total grows:
/// `9 open, 3 done, 2 expired`.
impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (done, label) = (self.done, &self.label);
        match self.expired {
            None => write!(f, "{done} of {} {label}", self.total()),
            Some(0) => write!(f, "{} open, {done} {label}", self.left),
            Some(expired) => write!(f, "{} open, {done} {label}, {expired} expired", self.left),
        }
    }
}

/// Formats a row as its progress, or as all its columns if none counts finished work.
#[must_use]
pub fn short_summary(row: &[ColumnValue]) -> String {
    Progress::from_row(row).map_or_else(|| details(row), |progress| progress.to_string())
}

/// Formats a row as its progress and all other columns.
#[must_use]
pub fn details(row: &[ColumnValue]) -> String {
    let progress = Progress::from_row(row);
    let is_in_progress = |kind| {
        progress.as_ref().is_some_and(|progress| match kind {
            ColumnKind::Done | ColumnKind::Expired => true,
            ColumnKind::Left => progress.expired.is_some(),
            _ => false,
        })
    };
    let others = row.iter().filter(|column| !is_in_progress(column.kind));
    let parts = progress.iter().map(ToString::to_string);
    let parts: Vec<String> = parts.chain(others.map(ToString::to_string)).collect();
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row<const N: usize>(columns: [Column; N], values: [FigureValue; N]) -> Vec<ColumnValue> {
        let columns = columns.iter().zip(values);
        columns
            .map(|(column, value)| column.with_value(value))
            .collect()
    }

    #[test]
    fn a_row_is_formatted_with_its_column_names() {
        let columns = [
            Column::left("places_left"),
            Column::done("places_visited", "visited"),
            Column::time("last_visit_ms", "visited"),
            Column::real("way_m"),
        ];
        let values = [5_u32.into(), 0_u32.into(), FigureValue::None, 0.0.into()];
        let at_first = row(columns, values);
        assert_eq!(short_summary(&at_first), "0 of 5 places visited");
        let values = [2_u32.into(), 3_u32.into(), 61_250_u64.into(), 7.5.into()];
        let later = row(columns, values);
        let others = "last visit 61.2 s, way 7.50 m";
        let expected = format!("3 of 5 places visited, places left 2, {others}");
        assert_eq!(details(&later), expected);
        assert_eq!(short_summary(&later[2..]), others);
    }

    #[test]
    fn work_that_can_expire_is_open_done_or_expired() {
        let columns = [
            Column::left("open"),
            Column::done("done", "done"),
            Column::expired("expired"),
        ];
        let late = row(columns, [1_u32, 2, 237].map(FigureValue::from));
        assert_eq!(Progress::from_row(&late).unwrap().total(), 240);
        let text = "1 open, 2 done, 237 expired";
        assert_eq!([short_summary(&late), details(&late)], [text; 2]);
        let first = row(columns, [9_u32, 0, 0].map(FigureValue::from));
        assert_eq!(short_summary(&first), "9 open, 0 done");
    }
}
