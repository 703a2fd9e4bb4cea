//! The tables of a logged run as text, with the rows that a compact log does not write.

use std::path::PathBuf;

use launch::Registry;
use pyo3::prelude::*;
use run_log::{RunLog, Table};

use crate::errors::alliance_error;

/// Returns the text of a table as a full log has it, up to the last complete tick. Returns `None` if a run has no table
/// of this name.
#[pyfunction]
pub fn full_table(py: Python<'_>, folder: PathBuf, file_name: &str) -> PyResult<Option<String>> {
    let mut tables = Table::ALL.into_iter();
    let Some(table) = tables.find(|table| table.file_name() == file_name) else {
        return Ok(None);
    };
    py.detach(|| {
        let log =
            RunLog::open(&folder, &Registry::built_in().vocabulary()).map_err(alliance_error)?;
        if let Some(damage) = log.damage() {
            return Err(alliance_error(format!("{}: {damage}", folder.display())));
        }
        let text = log.full_table(table, None).map_err(alliance_error)?;
        Ok(Some(String::from_utf8_lossy(&text).into_owned()))
    })
}
