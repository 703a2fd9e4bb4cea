//! Iteration over the rows of a table, in each form of the log.

use std::path::Path;

use scenario::time::SimTime;

use super::compact::{CompactError, CompactForm, MotivationRule, PredictedRows, RepeatedRows};
use super::level::LogLevel;
use super::read_error::{ReadError, malformed};
use super::rows::TableRow;
use super::run_file::RunFile;

/// The complete part of a table, and what its rows follow from.
#[derive(Clone, Copy)]
pub(super) struct RowSource<'l> {
    pub run: &'l RunFile,
    /// The location that errors name.
    pub folder: &'l Path,
    pub bytes: &'l [u8],
    /// The times of all ticks, in a log with a seal for each tick.
    pub times: &'l [SimTime],
}

/// The rows of a table, in the order of a full log.
pub struct Rows<'l, R> {
    folder: &'l Path,
    form: Form<'l, R>,
    /// True after an error, which ends the rows.
    failed: bool,
}

enum Form<'l, R> {
    EveryRow {
        rows: csv::DeserializeRecordsIntoIter<&'l [u8], R>,
        latest: Option<R>,
        lines: u64,
    },
    Predicted(Box<PredictedRows<'l, R>>),
    Repeated(Box<RepeatedRows<'l, R>>),
}

impl<'l, R: TableRow> Rows<'l, R> {
    pub(super) fn new(source: RowSource<'l>) -> Self {
        let RowSource {
            run,
            folder,
            bytes,
            times,
        } = source;
        let setup = &run.setup;
        let written = match R::FORM {
            _ if run.log != LogLevel::Compact => CompactForm::EveryRow,
            form => form,
        };
        let form = match written {
            CompactForm::EveryRow => Form::EveryRow {
                rows: csv::Reader::from_reader(bytes).into_deserialize(),
                latest: None,
                lines: 0,
            },
            CompactForm::Predicted(prediction) => {
                let rule = MotivationRule::new(setup);
                let rows = PredictedRows::new(prediction, rule, bytes, &setup.roster, times);
                Form::Predicted(Box::new(rows))
            }
            CompactForm::Repeated(repetition) => {
                Form::Repeated(Box::new(RepeatedRows::new(repetition, bytes)))
            }
        };
        Self {
            folder,
            form,
            failed: false,
        }
    }

    /// Returns the next row without a copy. A long run has millions of rows.
    pub fn advance(&mut self) -> Option<Result<&R, ReadError>> {
        if self.failed {
            return None;
        }
        let row = match &mut self.form {
            Form::EveryRow {
                rows,
                latest,
                lines,
            } => match rows.next() {
                None => Ok(None),
                Some(row) => {
                    *lines += 1;
                    row.map(|row| Some(&*latest.insert(row)))
                        .map_err(CompactError::from)
                }
            },
            Form::Predicted(rows) => rows.advance(),
            Form::Repeated(rows) => rows.advance(),
        };
        self.failed = row.is_err();
        let folder = self.folder;
        row.map_err(|error| malformed(folder, R::TABLE, &error))
            .transpose()
    }

    /// Returns the number of rows of the file that have been used, for the progress of the reader.
    #[must_use]
    pub fn lines(&self) -> u64 {
        match &self.form {
            Form::EveryRow { lines, .. } => *lines,
            Form::Predicted(rows) => rows.lines(),
            Form::Repeated(rows) => rows.lines(),
        }
    }
}

impl<R: TableRow> Iterator for Rows<'_, R> {
    type Item = Result<R, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance().map(|row| row.cloned())
    }
}
