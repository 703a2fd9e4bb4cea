//! Errors of the reader of a run folder.

use std::io;
use std::path::{Path, PathBuf};

use super::table::Table;

/// An error of a folder that is not a readable run.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    #[error("{} is not the folder of a run: {why}", folder.display())]
    NoRun { folder: PathBuf, why: &'static str },
    #[error("cannot read {}: {error}", path.display())]
    Read { path: PathBuf, error: io::Error },
    /// The contents of a file do not match its name.
    #[error("{}: {reason}", path.display())]
    Malformed {
        path: PathBuf,
        /// The position and the cause.
        reason: String,
    },
}

/// Returns the error of a folder whose run.json cannot be read.
#[must_use]
pub fn no_run(folder: &Path, path: &Path, error: io::Error) -> ReadError {
    use io::ErrorKind::{NotADirectory, NotFound};
    let why = match error.kind() {
        NotFound if folder.exists() => "it has no run.json",
        NotFound => "there is no such folder",
        NotADirectory => "it is a file",
        _ => {
            let path = path.to_owned();
            return ReadError::Read { path, error };
        }
    };
    let folder = folder.to_owned();
    ReadError::NoRun { folder, why }
}

/// Returns the error of a table whose contents do not match its name.
pub(super) fn malformed(folder: &Path, table: Table, reason: &dyn std::error::Error) -> ReadError {
    ReadError::Malformed {
        path: folder.join(table.file_name()),
        // A malformed name or number can contain control characters.
        reason: reason.to_string().replace(char::is_control, " "),
    }
}
