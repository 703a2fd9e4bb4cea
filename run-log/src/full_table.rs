//! The text of a table with all rows.

use std::borrow::Cow;

use scenario::time::SimTime;

use super::column::CellValue;
use super::level::LogLevel;
use super::read::RunLog;
use super::read_error::ReadError;
use super::recorder::Row;
use super::rows::{AllocationRow, DeclaredRow, MessageRow, MotivationRow, PoseRow};
use super::table::Table;

impl RunLog {
    /// Returns a table as a full log has it, byte for byte, including the header line. With `at`, a compact log has only
    /// the rows of that time.
    ///
    /// # Errors
    /// Returns an error for malformed rows of a compact log.
    pub fn full_table(
        &self,
        table: Table,
        at: Option<SimTime>,
    ) -> Result<Cow<'_, [u8]>, ReadError> {
        let written = self.table(table);
        if self.run.log != LogLevel::Compact || written.is_empty() {
            return Ok(Cow::Borrowed(written));
        }
        let text = match table {
            Table::Motivations => text::<MotivationRow>(self, at),
            Table::Allocation => text::<AllocationRow>(self, at),
            Table::Messages => text::<MessageRow>(self, at),
            Table::Poses => text::<PoseRow>(self, at),
            _ => return Ok(Cow::Borrowed(written)),
        };
        text.map(Cow::Owned)
    }
}

fn text<R: DeclaredRow>(log: &RunLog, at: Option<SimTime>) -> Result<Vec<u8>, ReadError> {
    let mut bytes = R::HEADER.as_bytes().to_vec();
    let mut rows = log.each_row::<R>();
    while let Some(row) = rows.advance() {
        let row = row?;
        let mut columns = R::COLUMNS
            .iter()
            .map(|column| (column.value)(row))
            .peekable();
        // The first column is the time.
        let time = columns.peek();
        if at.is_none_or(|at| time == Some(&Some(CellValue::Whole(at.0)))) {
            columns.fold(Row::new(&mut bytes), with_cell).end();
        }
    }
    Ok(bytes)
}

fn with_cell<'b>(row: Row<'b>, value: Option<CellValue<'_>>) -> Row<'b> {
    match value {
        None => row.text(""),
        Some(CellValue::Whole(number)) => row.number(number),
        Some(CellValue::Single(number)) => row.real(number),
        Some(CellValue::Double(number)) => row.real(number),
        Some(CellValue::Flag(flag)) => row.flag(flag),
        Some(CellValue::Text(text)) => row.text(text),
        Some(CellValue::Hash(hash)) => row.hash(hash),
    }
}
