//! The destination of a log: a folder or memory.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::{Document, MemoryLog, Table};

use super::RecordError;

/// A destination for the recorder's output.
pub trait Sink {
    /// Appends bytes to a table.
    ///
    /// # Errors
    /// Returns [`RecordError::Write`]. The table may then end with a part of `bytes`.
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError>;

    /// Replaces a document atomically: a reader finds the old or the new text, never a part.
    ///
    /// # Errors
    /// Returns [`RecordError::Write`]. The old document, if any, is then still complete.
    fn replace(&mut self, document: Document, text: &str) -> Result<(), RecordError>;
}

#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    open: BTreeMap<Table, File>,
}

impl Folder {
    /// Creates the folder, with `logs/` for the output of the run's processes.
    ///
    /// # Errors
    /// Returns [`RecordError::FolderInUse`] if the folder contains a run, [`RecordError::Write`] if it cannot be created.
    pub fn create(path: impl Into<PathBuf>) -> Result<Self, RecordError> {
        let path = path.into();
        let logs = path.join("logs");
        fs::create_dir_all(&logs).map_err(|source| RecordError::write(&logs, source))?;
        Self::check_unused(&path)?;
        Ok(Self {
            path,
            open: BTreeMap::new(),
        })
    }

    /// Checks that the folder contains no run. It need not exist.
    ///
    /// # Errors
    /// Returns [`RecordError::FolderInUse`] if the folder contains a run.
    pub fn check_unused(path: &Path) -> Result<(), RecordError> {
        if path.join(Document::Run.file_name()).exists() {
            return Err(RecordError::FolderInUse(path.to_owned()));
        }
        Ok(())
    }

    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Sink for Folder {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        let path = self.path.join(table.file_name());
        let file = match self.open.get_mut(&table) {
            Some(file) => Ok(file),
            None => OpenOptions::new()
                .append(true)
                .create_new(true)
                .open(&path)
                .map(|file| self.open.entry(table).or_insert(file)),
        };
        file.and_then(|file| file.write_all(bytes))
            .map_err(|source| RecordError::write(&path, source))
    }

    fn replace(&mut self, document: Document, text: &str) -> Result<(), RecordError> {
        let path = self.path.join(document.file_name());
        let new = path.with_extension("json.new");
        let written = fs::write(&new, text).and_then(|()| fs::rename(&new, &path));
        written.map_err(|source| RecordError::write(&path, source))
    }
}

impl Sink for MemoryLog {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        self.tables
            .entry(table)
            .or_default()
            .extend_from_slice(bytes);
        Ok(())
    }

    fn replace(&mut self, document: Document, text: &str) -> Result<(), RecordError> {
        self.documents.insert(document, text.to_owned());
        Ok(())
    }
}
