//! A history that is read while a replay writes its log. The log is never in memory as a whole.

use std::io;
use std::path::PathBuf;

use csv::{ReaderBuilder, StringRecord};
use run_log::recorder::{RecordError, Sink};
use run_log::{Document, Table, TableRow};
use scenario::time::SimTime;

use super::history::{History, HistoryError};

/// A destination of a log that adds each row to a history.
pub(super) struct HistorySink {
    pub history: History,
    /// The header lines of the tables, in the order of [`Table::ALL`].
    headers: [Option<StringRecord>; Table::ALL.len()],
}

impl HistorySink {
    pub fn new(history: History) -> Self {
        Self {
            history,
            headers: Default::default(),
        }
    }

    /// Adds the rows of a piece of a table. The recorder appends whole rows.
    fn read<R: TableRow>(
        &mut self,
        bytes: &[u8],
        add: impl Fn(&mut History, R) -> Result<(), HistoryError>,
    ) -> io::Result<()> {
        let mut rows = ReaderBuilder::new().has_headers(false).from_reader(bytes);
        let mut row = StringRecord::new();
        while rows.read_record(&mut row)? {
            match &mut self.headers[R::TABLE as usize] {
                Some(header) => {
                    let row = row.deserialize(Some(header)).map_err(io::Error::other)?;
                    add(&mut self.history, row).map_err(io::Error::other)?;
                }
                header => *header = Some(row.clone()),
            }
        }
        Ok(())
    }

    /// Sets the end of the history from the last row of a piece of ticks.csv. The header line has no time.
    fn read_end(&mut self, bytes: &[u8]) {
        let row = bytes.trim_ascii_end().rsplit(|byte| *byte == b'\n').next();
        let time = row.and_then(|row| row.split(|byte| *byte == b',').next());
        let time = time.and_then(|time| str::from_utf8(time).ok()?.parse().ok());
        if let Some(time) = time {
            self.history.end = SimTime(time) + self.history.step;
        }
    }
}

impl Sink for HistorySink {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        let read = match table {
            Table::Motivations => self.read(bytes, |history, row| history.add_motivation(&row)),
            Table::Allocation => self.read(bytes, |history, row| history.add_utility(&row)),
            Table::Messages => self.read(bytes, |history, row| history.add_message(&row)),
            Table::Poses => self.read(bytes, |history, row| history.add_pose(&row)),
            Table::Events => self.read(bytes, |history, row| {
                history.events.push(row);
                Ok(())
            }),
            Table::Mission => self.read(bytes, |history, row| {
                history.mission.push(row);
                Ok(())
            }),
            Table::Ticks => {
                self.read_end(bytes);
                Ok(())
            }
            // A report does not show the other tables.
            _ => Ok(()),
        };
        read.map_err(|error| RecordError::Write {
            path: PathBuf::from(table.file_name()),
            error,
        })
    }

    fn replace(&mut self, _: Document, _: &str) -> Result<(), RecordError> {
        Ok(())
    }
}
