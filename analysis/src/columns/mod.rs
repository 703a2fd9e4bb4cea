//! Tables of results and of logs by column, as CSV and Parquet.

pub mod latex;
pub mod parquet;

use std::path::Path;

use run_log::{CellKind, CellValue, DeclaredRow, MissionRow};
use scenario::mission::columns::{self, ColumnKind};

use crate::new_file::write_atomically;

/// A function that returns the value in a row; `None` if it is missing.
type Value<R> = Box<dyn for<'r> Fn(&'r R) -> Option<CellValue<'r>>>;

/// The number of significant digits of a computed number. Rounding errors change only later digits.
const DIGITS: usize = 12;

/// A column with its type and the source of its values.
pub struct Column<R> {
    pub name: String,
    pub kind: CellKind,
    /// True if a value may be missing.
    pub is_optional: bool,
    pub value: Value<R>,
}

/// Returns the columns of a table of the log, in the order of the CSV.
pub fn declared<R: DeclaredRow>() -> Vec<Column<R>> {
    let columns = R::COLUMNS.iter().map(|column| Column {
        name: column.name.to_owned(),
        kind: column.kind,
        is_optional: column.is_optional,
        value: Box::new(column.value),
    });
    columns.collect()
}

/// Returns the columns of mission.csv, as the mission declares them.
pub fn of_mission(declared: &'static [columns::Column]) -> Vec<Column<MissionRow>> {
    let time = Column {
        name: "t_ms".to_owned(),
        kind: CellKind::Whole64,
        is_optional: false,
        value: Box::new(|row: &MissionRow| Some(CellValue::Whole(row.t_ms.0))),
    };
    let columns = declared.iter().map(|column| {
        let (name, is_real) = (column.name, column.kind == ColumnKind::Real);
        Column {
            name: name.to_owned(),
            kind: if is_real {
                CellKind::Double
            } else {
                CellKind::Whole64
            },
            is_optional: is_real || column.kind == ColumnKind::Time,
            value: Box::new(move |row: &MissionRow| match row.get(name)? {
                value if is_real => Some(CellValue::Double(value)),
                value => Some(CellValue::Whole(value as u64)),
            }),
        }
    });
    [time].into_iter().chain(columns).collect()
}

/// Rounds to a number of significant digits, through text so that 0.1 stays 0.1.
#[must_use]
pub fn rounded(value: f64, digits: usize) -> f64 {
    let text = format!("{value:.*e}", digits - 1);
    text.parse().unwrap_or(value)
}

/// Rows of results. All rows have the same columns.
#[derive(Default)]
pub struct Table {
    names: Vec<String>,
    rows: Vec<Vec<Entry>>,
}

/// A cell of a row; `None` for an empty cell. A column of numbers may contain whole numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    Text(Option<String>),
    Whole(Option<i64>),
    Number(Option<f64>),
    Flag(bool),
}

impl Entry {
    pub fn text(text: impl ToString) -> Self {
        Self::Text(Some(text.to_string()))
    }

    /// Returns a number without the sign of a zero.
    pub fn number(number: impl Into<Option<f64>>) -> Self {
        let number: Option<f64> = number.into();
        Self::Number(number.map(|number| number + 0.0))
    }

    /// Returns a computed number without the digits of rounding errors, such as 0.15 for 0.15000000000000002.
    pub fn computed(number: impl Into<Option<f64>>) -> Self {
        let number: Option<f64> = number.into();
        Self::number(number.map(|number| rounded(number, DIGITS)))
    }

    /// Returns a count, which is far below 2^63.
    #[must_use]
    pub fn count(count: usize) -> Self {
        Self::Whole(Some(count as i64))
    }

    /// Returns a computed value and the ends of its interval.
    #[must_use]
    pub fn with_interval(found: Option<(f64, (f64, f64))>) -> [Self; 3] {
        let [value, from, to] = match found {
            Some((value, (from, to))) => [value, from, to].map(Some),
            None => [None; 3],
        };
        [value, from, to].map(Self::computed)
    }

    /// Returns the value for a column of that type.
    fn value(&self, kind: CellKind) -> Option<CellValue<'_>> {
        match self {
            Self::Text(text) => text.as_deref().map(CellValue::Text),
            Self::Whole(number) if kind == CellKind::Double => {
                number.map(|number| CellValue::Double(number as f64))
            }
            // Parquet files get the same 64 bits as a signed number again.
            Self::Whole(number) => number.map(|number| CellValue::Whole(number as u64)),
            Self::Number(number) => number.map(CellValue::Double),
            Self::Flag(flag) => Some(CellValue::Flag(*flag)),
        }
    }

    /// Returns the value as text; empty for an empty cell.
    fn csv(&self) -> String {
        let shown = match self {
            Self::Text(text) => text.clone(),
            Self::Whole(number) => number.map(|number| number.to_string()),
            Self::Number(number) => number.map(|number| number.to_string()),
            Self::Flag(flag) => Some(flag.to_string()),
        };
        shown.unwrap_or_default()
    }
}

impl Table {
    /// Creates a table from rows with the same names.
    #[must_use]
    pub fn of_rows<'n, R: IntoIterator<Item = (&'n str, Entry)>>(
        rows: impl IntoIterator<Item = R>,
    ) -> Self {
        let mut table = Self::default();
        for row in rows {
            table.add(row);
        }
        table
    }

    pub fn add<'n>(&mut self, row: impl IntoIterator<Item = (&'n str, Entry)>) {
        let (names, row): (Vec<&str>, Vec<Entry>) = row.into_iter().unzip();
        if self.rows.is_empty() {
            self.names = names.into_iter().map(str::to_owned).collect();
        }
        debug_assert_eq!(self.names.len(), row.len());
        self.rows.push(row);
    }

    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Returns the table as CSV with a header line. Numbers have the shortest form that reads back unchanged.
    pub fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.names)?;
        for row in &self.rows {
            writer.write_record(row.iter().map(Entry::csv))?;
        }
        Ok(writer.into_inner()?)
    }

    /// Returns the table as a Parquet file. Equal rows give equal bytes.
    pub fn parquet(&self) -> anyhow::Result<Vec<u8>> {
        let columns = self.names.iter().enumerate().map(|(place, name)| {
            let kind = self.kind(place);
            Column {
                name: name.clone(),
                kind,
                is_optional: true,
                value: Box::new(move |row: &Vec<Entry>| row[place].value(kind)),
            }
        });
        let columns: Vec<Column<Vec<Entry>>> = columns.collect();
        let mut bytes = Vec::new();
        let mut file = parquet::create(&mut bytes, "runs", &columns, None)?;
        parquet::write_group(&mut file, &columns, &self.rows)?;
        file.close()?;
        Ok(bytes)
    }

    /// Returns the type of a column. Whole numbers among others are numbers.
    fn kind(&self, place: usize) -> CellKind {
        let cells = || self.rows.iter().map(|row| &row[place]);
        for cell in cells() {
            match cell {
                Entry::Text(_) => return CellKind::Text,
                Entry::Flag(_) => return CellKind::Flag,
                Entry::Number(Some(_)) => return CellKind::Double,
                Entry::Number(None) | Entry::Whole(_) => {}
            }
        }
        match cells().any(|cell| matches!(cell, Entry::Whole(_))) {
            true => CellKind::Whole64,
            false => CellKind::Double,
        }
    }

    /// Writes the table into a folder as `name.csv`.
    pub fn write_csv(&self, folder: &Path, name: &str) -> anyhow::Result<()> {
        write_atomically(&folder.join(format!("{name}.csv")), &self.csv()?)
    }

    /// Writes the table into a folder as `name.csv` and `name.parquet`.
    pub fn write(&self, folder: &Path, name: &str) -> anyhow::Result<()> {
        self.write_csv(folder, name)?;
        write_atomically(&folder.join(format!("{name}.parquet")), &self.parquet()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_has_no_sign() {
        let [mean, from, to] = Entry::with_interval(Some((-0.0, (-0.5, -0.0))));
        let texts = [mean, from, to, Entry::number(-0.0)].map(|entry| entry.csv());
        assert_eq!(texts, ["0", "-0.5", "0", "0"]);
    }

    #[test]
    fn computed_numbers_have_no_digits_of_rounding_errors() {
        let numbers = [
            (349.3 - 327.25, "22.05"),
            (0.1 + 0.05, "0.15"),
            (-34.800_000_000_000_01, "-34.8"),
            (1.0 / 3.0, "0.333333333333"),
            (123_456_789.0, "123456789"),
            (-0.0, "0"),
        ];
        for (number, text) in numbers {
            assert_eq!(Entry::computed(number).csv(), text);
        }
        assert_eq!(Entry::computed(None::<f64>).csv(), "");
        let [mean, from, to] = Entry::with_interval(Some((0.1 + 0.2, (0.1 + 0.05, 1.1 * 3.0))));
        assert_eq!(
            [mean, from, to].map(|entry| entry.csv()),
            ["0.3", "0.15", "3.3"]
        );
    }
}
