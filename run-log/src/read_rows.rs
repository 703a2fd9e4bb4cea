//! Iteration over the rows of a table, in each form of the log.

use super::compact::{CompactError, CompactForm, MotivationRule, PredictedRows, RepeatedRows};
use super::level::LogLevel;
use super::read::{ReadError, RunLog};
use super::rows::TableRow;

/// The rows of a table, in the order of a full log.
pub struct Rows<'l, R> {
    log: &'l RunLog,
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
    pub(super) fn new(log: &'l RunLog) -> Self {
        let bytes = log.table(R::TABLE);
        let setup = &log.run.setup;
        let written = match R::FORM {
            _ if log.run.log != LogLevel::Compact => CompactForm::EveryRow,
            form => form,
        };
        let form = match written {
            CompactForm::EveryRow => Form::EveryRow {
                rows: csv::Reader::from_reader(bytes).into_deserialize(),
                latest: None,
                lines: 0,
            },
            CompactForm::Predicted(prediction) => {
                let (rule, times) = (MotivationRule::new(setup), log.times());
                let rows = PredictedRows::new(prediction, rule, bytes, &setup.roster, times);
                Form::Predicted(Box::new(rows))
            }
            CompactForm::Repeated(repetition) => {
                Form::Repeated(Box::new(RepeatedRows::new(repetition, bytes)))
            }
        };
        Self {
            log,
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
        let log = self.log;
        row.map_err(|error| log.malformed(R::TABLE, &error))
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
