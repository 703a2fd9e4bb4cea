//! The rows that a recorder has written since the last tick.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use run_log::recorder::{RecordError, Sink};
use run_log::{Document, ReadError, RunLog, Table, TableRow};

/// A source of the rows of all tables.
pub trait RowSource {
    /// Iterates over the rows of a table.
    fn each_row<R: TableRow>(&self) -> impl Iterator<Item = Result<R, ReadError>>;
}

impl RowSource for RunLog {
    fn each_row<R: TableRow>(&self) -> impl Iterator<Item = Result<R, ReadError>> {
        self.each_row()
    }
}

/// A log of which only the newest rows are kept. Clones share them.
#[derive(Clone, Default)]
pub struct NewRows(Arc<Mutex<BTreeMap<Table, NewTable>>>);

#[derive(Default)]
struct NewTable {
    /// The first line, with its line end.
    header: Vec<u8>,
    rows: Vec<u8>,
}

impl NewRows {
    /// Removes the rows of all tables.
    pub(super) fn clear(&self) {
        self.lock()
            .values_mut()
            .for_each(|table| table.rows.clear());
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Table, NewTable>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl RowSource for NewRows {
    fn each_row<R: TableRow>(&self) -> impl Iterator<Item = Result<R, ReadError>> {
        let tables = self.lock();
        let table = tables.get(&R::TABLE);
        let text = table.map(|table| [table.header.as_slice(), &table.rows].concat());
        let rows = csv::Reader::from_reader(Cursor::new(text.unwrap_or_default()));
        rows.into_deserialize().map(|row| {
            row.map_err(|error| ReadError::Malformed {
                path: PathBuf::from(R::TABLE.file_name()),
                reason: error.to_string(),
            })
        })
    }
}

impl Sink for NewRows {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        // These have no rows.
        if matches!(table, Table::Inputs | Table::External) {
            return Ok(());
        }
        let mut tables = self.lock();
        let table = tables.entry(table).or_default();
        let mut rows = bytes;
        if table.header.is_empty() {
            let end = bytes.iter().position(|byte| *byte == b'\n');
            let (header, rest) = bytes.split_at(end.map_or(0, |end| end + 1));
            table.header = header.to_vec();
            rows = rest;
        }
        table.rows.extend(rows);
        Ok(())
    }

    fn replace(&mut self, _: Document, _: &str) -> Result<(), RecordError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use run_log::TickRow;

    use super::*;

    #[test]
    fn rows_are_those_since_the_last_tick() {
        let mut rows = NewRows::default();
        let ticks = |rows: &NewRows| -> Vec<u64> {
            let found = rows.each_row::<TickRow>();
            found.map(|row| row.unwrap().tick).collect()
        };
        assert!(ticks(&rows).is_empty());
        let header = Table::Ticks.header().unwrap();
        let row = |tick: u64| format!("{},{tick},world,run,{tick:016x}\n", 50 * tick);
        let mut append = |text: String| rows.append(Table::Ticks, text.as_bytes()).unwrap();
        append(header.to_owned());
        append(row(0) + &row(1));
        assert_eq!(ticks(&rows), [0, 1]);
        rows.clear();
        assert!(ticks(&rows).is_empty());
        rows.append(Table::Ticks, row(2).as_bytes()).unwrap();
        assert_eq!(ticks(&rows), [2]);
    }
}
