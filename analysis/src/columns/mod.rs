//! Tables of results by column, as CSV and Parquet.

pub mod parquet;

use std::path::Path;

use crate::new_file::write_atomically;

#[derive(Default)]
pub struct Table {
    pub columns: Vec<Column>,
}

pub struct Column {
    pub name: String,
    pub values: Values,
}

/// Values by row; `None` for an empty cell.
pub enum Values {
    Integers(Vec<Option<i64>>),
    Numbers(Vec<Option<f64>>),
    Flags(Vec<Option<bool>>),
    Texts(Vec<Option<String>>),
}

use Values::{Flags, Integers, Numbers, Texts};

/// A cell of a row.
pub enum Entry {
    Text(String),
    Whole(usize),
    Number(Option<f64>),
    Flag(bool),
}

impl Entry {
    /// Returns a value and the ends of its interval.
    #[must_use]
    pub fn with_interval(found: Option<(f64, (f64, f64))>) -> [Self; 3] {
        let number = |of: fn((f64, (f64, f64))) -> f64| Self::Number(found.map(of));
        [
            number(|found| found.0),
            number(|found| found.1.0),
            number(|found| found.1.1),
        ]
    }
}

impl Table {
    /// Creates a table from rows. All rows need the same names with the same types.
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

    /// Appends a row. All rows need the same names with the same types.
    pub fn add<'n>(&mut self, row: impl IntoIterator<Item = (&'n str, Entry)>) {
        let is_first = self.rows() == 0;
        for (place, (name, entry)) in row.into_iter().enumerate() {
            if is_first {
                let values = match &entry {
                    Entry::Text(_) => Texts(Vec::new()),
                    Entry::Whole(_) => Integers(Vec::new()),
                    Entry::Number(_) => Numbers(Vec::new()),
                    Entry::Flag(_) => Flags(Vec::new()),
                };
                let name = name.to_owned();
                self.columns.push(Column { name, values });
            }
            match (&mut self.columns[place].values, entry) {
                (Texts(values), Entry::Text(text)) => values.push(Some(text)),
                // Counts of runs and seeds are far below 2^63.
                (Integers(values), Entry::Whole(count)) => values.push(Some(count as i64)),
                (Numbers(values), Entry::Number(number)) => values.push(number),
                (Flags(values), Entry::Flag(flag)) => values.push(Some(flag)),
                _ => debug_assert!(false, "{name} changes its type"),
            }
        }
    }

    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |first| match &first.values {
            Integers(values) => values.len(),
            Numbers(values) => values.len(),
            Flags(values) => values.len(),
            Texts(values) => values.len(),
        })
    }

    /// Returns the table as CSV with a header line. Numbers have the shortest form that reads back unchanged.
    pub fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(self.columns.iter().map(|column| &column.name))?;
        for row in 0..self.rows() {
            writer.write_record(self.columns.iter().map(|column| column.values.text(row)))?;
        }
        Ok(writer.into_inner()?)
    }

    /// Writes the table into a folder as `name.csv`.
    pub fn write_csv(&self, folder: &Path, name: &str) -> anyhow::Result<()> {
        write_atomically(folder, &format!("{name}.csv"), &self.csv()?)
    }

    /// Writes the table into a folder as `name.csv` and `name.parquet`.
    pub fn write(&self, folder: &Path, name: &str) -> anyhow::Result<()> {
        self.write_csv(folder, name)?;
        let bytes = parquet::to_parquet(&self.columns)?;
        write_atomically(folder, &format!("{name}.parquet"), &bytes)
    }
}

impl Values {
    /// Returns a value as text; empty for an empty cell.
    fn text(&self, row: usize) -> String {
        fn show<T: ToString>(value: Option<&T>) -> String {
            value.map_or_else(String::new, T::to_string)
        }
        match self {
            Integers(values) => show(values[row].as_ref()),
            Numbers(values) => show(values[row].as_ref()),
            Flags(values) => show(values[row].as_ref()),
            Texts(values) => show(values[row].as_ref()),
        }
    }
}
