//! The source of the files of `alliance cluster keys`: a folder, or standard input for keys that are used in a single run.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use scenario::Problem;
use serde::{Deserialize, Serialize};

/// The option value for standard input.
pub const STANDARD_INPUT: &str = "-";

#[derive(Clone, Debug)]
pub enum KeyFiles {
    Folder(PathBuf),
    Memory(MemoryKeyFiles),
}

/// The contents of each file by its name.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MemoryKeyFiles(BTreeMap<String, String>);

/// Omits the secret contents.
impl fmt::Debug for MemoryKeyFiles {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_set().entries(self.0.keys()).finish()
    }
}

impl FromIterator<(String, String)> for MemoryKeyFiles {
    fn from_iter<T: IntoIterator<Item = (String, String)>>(files: T) -> Self {
        Self(files.into_iter().collect())
    }
}

impl MemoryKeyFiles {
    /// Parses the output of [`to_line`](Self::to_line).
    pub fn from_line(line: &str) -> Result<Self, Problem> {
        serde_json::from_str(line).map_err(|error| {
            let remedy = "write one line of JSON: an object that maps file names to file contents";
            Problem::with_source("standard input", error.to_string(), remedy)
        })
    }

    /// Returns the files as one line for another process.
    #[must_use]
    pub fn to_line(&self) -> String {
        serde_json::json!(self).to_string() + "\n"
    }
}

impl KeyFiles {
    /// Returns the key files that a command-line option selects. For [`STANDARD_INPUT`] it reads one line.
    pub fn from_option(place: &Path) -> Result<Self, Problem> {
        if place == Path::new(STANDARD_INPUT) {
            let mut line = String::new();
            let result = io::stdin().read_line(&mut line);
            result.map_err(|error| at("standard input".to_owned(), error))?;
            return MemoryKeyFiles::from_line(&line).map(Self::Memory);
        }
        let folder = std::path::absolute(place);
        let folder = folder.map_err(|error| at(place.display().to_string(), error))?;
        Ok(Self::Folder(folder))
    }

    /// Reads a public file, such as a certificate.
    pub fn public(&self, name: &str) -> Result<String, Problem> {
        match self {
            Self::Folder(folder) => fs::read_to_string(folder.join(name))
                .map_err(|error| at(self.location(name), error)),
            Self::Memory(files) => {
                let file = files.0.get(name).cloned();
                file.ok_or_else(|| missing(self.location(name)))
            }
        }
    }

    /// Reads a secret file, and checks that it is private.
    pub fn private(&self, name: &str) -> Result<String, Problem> {
        if let Self::Folder(folder) = self {
            let metadata = fs::metadata(folder.join(name));
            let metadata = metadata.map_err(|error| at(self.location(name), error))?;
            if metadata.permissions().mode() & 0o077 != 0 {
                let what = "other users can read or change it";
                return Err(Problem::with_source(
                    self.location(name),
                    what,
                    "run `chmod 600` on it",
                ));
            }
        }
        self.public(name)
    }

    /// Returns the location of a file for messages.
    #[must_use]
    pub fn location(&self, name: &str) -> String {
        match self {
            Self::Folder(folder) => folder.join(name).display().to_string(),
            Self::Memory(_) => format!("standard input, {name}"),
        }
    }
}

fn at(place: String, error: io::Error) -> Problem {
    match error.kind() {
        ErrorKind::NotFound => missing(place),
        _ => Problem::with_source(place, error.to_string(), ""),
    }
}

fn missing(place: String) -> Problem {
    let remedy = "copy it from the folder that `alliance cluster keys` created";
    Problem::with_source(place, "file not found", remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_survive_a_round_trip_through_one_line() {
        let files = [("ca.pem", "a\nb\n"), ("world.key", "\"ö\"")];
        let files = files.map(|(name, text)| (name.to_owned(), text.to_owned()));
        let files = MemoryKeyFiles::from_iter(files);
        let line = files.to_line();
        assert_eq!(line.find('\n'), Some(line.len() - 1));
        assert_eq!(MemoryKeyFiles::from_line(&line).unwrap(), files);
        assert_eq!(format!("{files:?}"), r#"{"ca.pem", "world.key"}"#);
    }

    #[test]
    fn a_malformed_line_is_rejected() {
        for line in ["", "ca.pem\n", "[]", r#"{"ca.pem": 1}"#] {
            let error = MemoryKeyFiles::from_line(line).unwrap_err().to_string();
            assert_eq!(error.lines().count(), 1);
            let remedy =
                "; write one line of JSON: an object that maps file names to file contents";
            assert!(
                error.starts_with("standard input: ") && error.ends_with(remedy),
                "{error}"
            );
        }
    }
}
