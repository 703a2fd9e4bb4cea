//! Reader of repeated rows.

use std::collections::BTreeMap;

use csv::StringRecord;
use scenario::time::SimTime;
use serde::de::DeserializeOwned;

use super::{CompactError, Repetition};

/// The number of columns that each row contains: the time, the receiver and the sender.
const WRITTEN_COLUMNS: usize = 3;

pub(crate) struct RepeatedRows<'l, R> {
    form: Repetition<R>,
    file: csv::Reader<&'l [u8]>,
    header: StringRecord,
    record: StringRecord,
    /// The latest row of each sender.
    latest: BTreeMap<String, R>,
    lines: u64,
}

impl<'l, R: Clone + DeserializeOwned> RepeatedRows<'l, R> {
    pub fn new(form: Repetition<R>, bytes: &'l [u8]) -> Self {
        Self {
            file: csv::Reader::from_reader(bytes),
            header: form.header.trim_end().split(',').collect(),
            form,
            record: StringRecord::new(),
            latest: BTreeMap::new(),
            lines: 0,
        }
    }

    /// Returns the next row.
    pub fn advance(&mut self) -> Result<Option<&R>, CompactError> {
        if !self.file.read_record(&mut self.record)? {
            return Ok(None);
        }
        self.lines += 1;
        let line = self.record.position().map_or(0, csv::Position::line);
        let field = |column| self.record.get(column).unwrap_or_default();
        let [time, receiver, sender] = [0, 1, 2].map(field);
        if !self.record.iter().skip(WRITTEN_COLUMNS).all(str::is_empty) {
            let row: R = self.record.deserialize(Some(&self.header))?;
            self.latest.insert(sender.to_owned(), row);
        }
        let row = self.latest.get_mut(sender);
        let row = row.ok_or(CompactError::NoEarlierMessage(line))?;
        let time = time.parse().map_err(|_| CompactError::Time(line))?;
        *(self.form.time)(row) = SimTime(time);
        let name = (self.form.receiver)(row);
        name.clear();
        name.push_str(receiver);
        Ok(Some(row))
    }

    /// Returns the number of rows of the file that were read.
    pub fn lines(&self) -> u64 {
        self.lines
    }
}
