//! Where the files of `alliance keys` come from: a folder, or standard input, by which those of one run come that are in no folder.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// The place of an option that means standard input.
pub const STANDARD_INPUT: &str = "-";

/// Files of one member, or of several.
#[derive(Clone, Debug)]
pub enum KeyFiles {
    /// In that folder.
    Folder(PathBuf),
    /// In no folder.
    Memory(KeysInMemory),
}

/// The text of each file by its name.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeysInMemory(BTreeMap<String, String>);

/// Nothing that is secret.
impl fmt::Debug for KeysInMemory {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_set().entries(self.0.keys()).finish()
    }
}

impl FromIterator<(String, String)> for KeysInMemory {
    fn from_iter<T: IntoIterator<Item = (String, String)>>(files: T) -> Self {
        Self(files.into_iter().collect())
    }
}

impl KeysInMemory {
    /// Reads what [`to_line`](Self::to_line) has written.
    ///
    /// # Errors
    /// When it is something else.
    pub fn of_line(line: &str) -> Result<Self, KeyFilesError> {
        serde_json::from_str(line).map_err(KeyFilesError::Line)
    }

    /// As one line, by which they go to another process.
    #[must_use]
    pub fn to_line(&self) -> String {
        serde_json::json!(self).to_string() + "\n"
    }
}

/// Why a file of keys cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum KeyFilesError {
    /// There is no such folder, or no such file in it.
    #[error("{0}: is not there; copy it from where `alliance keys` made it")]
    Missing(String),
    /// The file system refused.
    #[error("{place}: {error}")]
    Io {
        /// Which file.
        place: String,
        /// What it said.
        error: io::Error,
    },
    /// Others than its owner may read a file that is secret.
    #[error("{0}: others may read or change it; `chmod 600` it")]
    Open(String),
    /// Not what [`KeysInMemory::to_line`] writes.
    #[error(
        "standard input: {0}; write one line of JSON, an object with the text of each file by its name"
    )]
    Line(serde_json::Error),
}

impl KeyFiles {
    /// Those of an option: a folder, or [`STANDARD_INPUT`], of which one line is read.
    ///
    /// # Errors
    /// When that line cannot be read, or is something else; or the folder is named from here, and here is nowhere.
    pub fn of_option(place: &Path) -> Result<Self, KeyFilesError> {
        if place == Path::new(STANDARD_INPUT) {
            let mut line = String::new();
            let read = io::stdin().read_line(&mut line);
            read.map_err(|error| at("standard input".to_owned(), error))?;
            return KeysInMemory::of_line(&line).map(Self::Memory);
        }
        let folder = std::path::absolute(place);
        let folder = folder.map_err(|error| at(place.display().to_string(), error))?;
        Ok(Self::Folder(folder))
    }

    /// A certificate.
    ///
    /// # Errors
    /// When it is missing or cannot be read.
    pub fn public(&self, name: &str) -> Result<String, KeyFilesError> {
        match self {
            Self::Folder(folder) => {
                fs::read_to_string(folder.join(name)).map_err(|error| at(self.place(name), error))
            }
            Self::Memory(files) => {
                let file = files.0.get(name).cloned();
                file.ok_or_else(|| KeyFilesError::Missing(self.place(name)))
            }
        }
    }

    /// What is nobody's but its owner's.
    ///
    /// # Errors
    /// As of [`public`](Self::public), and where others may read it.
    pub fn private(&self, name: &str) -> Result<String, KeyFilesError> {
        if let Self::Folder(folder) = self {
            let metadata = fs::metadata(folder.join(name));
            let metadata = metadata.map_err(|error| at(self.place(name), error))?;
            if metadata.permissions().mode() & 0o077 != 0 {
                return Err(KeyFilesError::Open(self.place(name)));
            }
        }
        self.public(name)
    }

    /// For people: where that file is.
    #[must_use]
    pub fn place(&self, name: &str) -> String {
        match self {
            Self::Folder(folder) => folder.join(name).display().to_string(),
            Self::Memory(_) => format!("standard input, {name}"),
        }
    }
}

fn at(place: String, error: io::Error) -> KeyFilesError {
    match error.kind() {
        ErrorKind::NotFound => KeyFilesError::Missing(place),
        _ => KeyFilesError::Io { place, error },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_go_to_another_process_in_one_line() {
        let files = [("ca.pem", "a\nb\n"), ("world.key", "\"ö\"")];
        let files = files.map(|(name, text)| (name.to_owned(), text.to_owned()));
        let files = KeysInMemory::from_iter(files);
        let line = files.to_line();
        assert_eq!(line.find('\n'), Some(line.len() - 1));
        assert_eq!(KeysInMemory::of_line(&line).unwrap(), files);
        assert_eq!(format!("{files:?}"), r#"{"ca.pem", "world.key"}"#);
    }

    #[test]
    fn another_line_is_refused() {
        for line in ["", "ca.pem\n", "[]", r#"{"ca.pem": 1}"#] {
            let said = KeysInMemory::of_line(line).unwrap_err().to_string();
            assert_eq!(said.lines().count(), 1);
            let remedy =
                "; write one line of JSON, an object with the text of each file by its name";
            assert!(
                said.starts_with("standard input: ") && said.ends_with(remedy),
                "{said}"
            );
        }
    }
}
