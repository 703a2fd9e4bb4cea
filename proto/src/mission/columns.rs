//! The columns of mission.csv as a mission declares them, and how far it has come in their words.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Value;

/// At the end of the name of a time.
const MILLISECONDS: &str = "_ms";

/// A column of mission.csv after the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Column {
    /// Its name in the file.
    pub name: &'static str,
    /// What it counts.
    pub kind: ColumnKind,
    /// Kind of the events that change it: those count as effects on the world, and a [time](ColumnKind::Time) is that of the
    /// latest one.
    pub event: Option<&'static str>,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ColumnKind {
    /// How many are done: the progress of the mission.
    Done,
    /// How many are left to do, in whatever state.
    Left,
    /// Any other count.
    Count,
    /// Simulated time of the latest of something that happens again and again, ms; none before the first.
    Time,
    /// Any other number.
    Real,
}

impl Column {
    /// A column that counts what is done, one at each event of that kind.
    #[must_use]
    pub const fn done(name: &'static str, event: &'static str) -> Self {
        Self::new(name, ColumnKind::Done, Some(event))
    }

    /// A column that counts what is left to do.
    #[must_use]
    pub const fn left(name: &'static str) -> Self {
        Self::new(name, ColumnKind::Left, None)
    }

    /// A column that counts something else.
    #[must_use]
    pub const fn count(name: &'static str) -> Self {
        Self::new(name, ColumnKind::Count, None)
    }

    /// A column that tells when an event of that kind happened last, ms.
    #[must_use]
    pub const fn time(name: &'static str, event: &'static str) -> Self {
        Self::new(name, ColumnKind::Time, Some(event))
    }

    /// A column of numbers.
    #[must_use]
    pub const fn real(name: &'static str) -> Self {
        Self::new(name, ColumnKind::Real, None)
    }

    const fn new(name: &'static str, kind: ColumnKind, event: Option<&'static str>) -> Self {
        Self { name, kind, event }
    }

    /// With its value in a row.
    #[must_use]
    pub fn with(&self, value: Value) -> ColumnValue {
        ColumnValue {
            name: self.name.to_owned(),
            kind: self.kind,
            value,
        }
    }

    /// With its value as a view has it.
    #[must_use]
    pub fn seen(&self, number: Option<f64>) -> ColumnValue {
        let value = match self.kind {
            ColumnKind::Real => number.into(),
            _ => number.map(|number| number as u64).into(),
        };
        self.with(value)
    }
}

/// What people call a column or a figure: `last_report_ms` is a `last report`, for a time is told with its unit.
#[must_use]
pub fn label(name: &str) -> String {
    let name = name.strip_suffix(MILLISECONDS).unwrap_or(name);
    name.replace(['_', '.'], " ")
}

/// A column or a figure with its value, as people read it: `items carried 1`, `last report 61.2 s`.
#[must_use]
pub fn told(name: &str, value: Value) -> String {
    let label = label(name);
    let Some(number) = value.number() else {
        return format!("{label} –");
    };
    match value {
        _ if name.ends_with(MILLISECONDS) => format!("{label} {:.1} s", number / 1000.0),
        Value::Real(_) => format!("{label} {number:.2}"),
        _ => format!("{label} {number}"),
    }
}

/// What a column tells at some time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColumnValue {
    /// Its name in mission.csv.
    pub name: String,
    /// What it counts.
    pub kind: ColumnKind,
    /// Its value in the latest row; `null`: none.
    pub value: Value,
}

/// See [`told`].
impl fmt::Display for ColumnValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&told(&self.name, self.value))
    }
}

/// How far a mission has come, for one that counts what is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Progress {
    /// How much is done.
    pub done: u64,
    /// With what is left to do.
    pub total: u64,
    /// Of what, and what is done to it: `items delivered`.
    pub what: String,
}

impl Progress {
    /// In a row with these columns; `None` if none of them counts what is done.
    #[must_use]
    pub fn of(row: &[ColumnValue]) -> Option<Self> {
        let sum = |kind| {
            let of_kind = row.iter().filter(|column| column.kind == kind);
            of_kind.map(|column| column.value.count()).sum::<u64>()
        };
        let first = row.iter().find(|it| it.kind == ColumnKind::Done)?;
        let done = sum(ColumnKind::Done);
        Some(Self {
            done,
            total: done + sum(ColumnKind::Left),
            what: label(&first.name),
        })
    }
}

/// `3 of 24 items delivered`.
impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} {}", self.done, self.total, self.what)
    }
}

/// A row in words: how far the mission has come, or else all that its columns tell.
#[must_use]
pub fn in_short(row: &[ColumnValue]) -> String {
    Progress::of(row).map_or_else(|| in_full(row), |progress| progress.to_string())
}

/// A row in words: how far the mission has come, and all that its other columns tell.
#[must_use]
pub fn in_full(row: &[ColumnValue]) -> String {
    let progress = Progress::of(row);
    let others = row.iter().filter(|column| column.kind != ColumnKind::Done);
    let told = progress.iter().map(ToString::to_string);
    let told: Vec<String> = told.chain(others.map(ToString::to_string)).collect();
    told.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_in_the_words_of_its_columns() {
        const COLUMNS: [Column; 4] = [
            Column::left("places_left"),
            Column::done("places_visited", "visited"),
            Column::time("last_visit_ms", "visited"),
            Column::real("way_m"),
        ];
        let row = |values: [Value; 4]| -> Vec<ColumnValue> {
            let columns = COLUMNS.iter().zip(values);
            columns.map(|(column, value)| column.with(value)).collect()
        };
        let at_first = row([5_u32.into(), 0_u32.into(), Value::None, 0.0.into()]);
        assert_eq!(in_short(&at_first), "0 of 5 places visited");
        let later = row([2_u32.into(), 3_u32.into(), 61_250_u64.into(), 7.5.into()]);
        assert_eq!(
            in_full(&later),
            "3 of 5 places visited, places left 2, last visit 61.2 s, way m 7.50"
        );
        assert_eq!(in_short(&later[2..]), "last visit 61.2 s, way m 7.50");
    }
}
