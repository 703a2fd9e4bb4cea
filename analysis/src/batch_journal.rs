//! The journal of a search: batches of results, in the order of their requests. A search that is started again takes
//! its first results from the journal.

use std::collections::VecDeque;
use std::fmt::Debug;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::sweep::lines::{LineFile, numbered_lines, parse_line};

/// The first line of a journal, which identifies the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// The kind of search and the name of its plan.
    pub search: (String, String),
    pub version: String,
    /// The digest of the plan.
    pub digest: String,
}

impl Header {
    /// Creates the header of a search by this program.
    #[must_use]
    pub fn new(kind: &str, name: &str, digest: String) -> Self {
        Self {
            search: (kind.to_owned(), name.to_owned()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            digest,
        }
    }
}

/// A line of the journal: the results that were requested together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Batch<R> {
    /// The digest of the request.
    asked: String,
    /// The wall-clock time of the batch, if the budget of the search is a time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elapsed_ms: Option<u64>,
    pub results: Vec<R>,
}

/// A journal that is open for writing, with the stored batches that were not requested again.
pub struct BatchJournal<R> {
    lines: LineFile,
    known: VecDeque<Batch<R>>,
}

impl<R: Serialize + DeserializeOwned> BatchJournal<R> {
    /// Opens a journal, or starts a new one.
    ///
    /// # Errors
    /// Returns an error if the journal belongs to another search, is damaged, or cannot be written.
    pub fn open(path: PathBuf, header: &Header) -> anyhow::Result<Self> {
        let (mut lines, bytes) = LineFile::open(path)?;
        let path = lines.path().display().to_string();
        let mut known = VecDeque::new();
        let broken = |(number, what)| {
            anyhow!(
                "{path}:{number}: {what}; remove this line and all below it to repeat their runs"
            )
        };
        for line in numbered_lines(&bytes) {
            if line.0 > 1 {
                known.push_back(parse_line(line, "").map_err(broken)?);
                continue;
            }
            let found: Header = parse_line(line, "").map_err(broken)?;
            if found != *header {
                bail!(
                    "{} holds another {}, or this one before it was changed; name a new folder with --out, or remove that folder",
                    lines.path().parent().unwrap_or(lines.path()).display(),
                    header.search.0
                );
            }
        }
        if bytes.is_empty() {
            lines.add(header)?;
        }
        Ok(Self { lines, known })
    }

    #[must_use]
    pub fn path(&self) -> &Path {
        self.lines.path()
    }

    /// Returns the number of stored results that were not requested again.
    #[must_use]
    pub fn done(&self) -> usize {
        self.known.iter().map(|batch| batch.results.len()).sum()
    }

    /// Returns the next stored batch; `None` after the last one.
    ///
    /// # Errors
    /// Returns an error if the stored batch belongs to another request.
    pub fn take(&mut self, request: &impl Debug) -> anyhow::Result<Option<Batch<R>>> {
        let known = self.known.pop_front();
        if known
            .as_ref()
            .is_some_and(|known| known.asked != digest(request))
        {
            bail!(
                "{} contains other runs than requested; remove it to start again",
                self.path().display()
            );
        }
        Ok(known)
    }

    /// Stores the results of a request, and returns them.
    pub fn add(
        &mut self,
        request: &impl Debug,
        elapsed_ms: Option<u64>,
        results: Vec<R>,
    ) -> anyhow::Result<Vec<R>> {
        let batch = Batch {
            asked: digest(request),
            elapsed_ms,
            results,
        };
        self.lines.add(&batch)?;
        Ok(batch.results)
    }
}

fn digest(request: &impl Debug) -> String {
    format!("{:016x}", xxh3_64(format!("{request:?}").as_bytes()))
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    fn open(path: &Path, digest: &str) -> anyhow::Result<BatchJournal<Option<f64>>> {
        let header = Header::new("tuning", "t", digest.to_owned());
        BatchJournal::open(path.to_owned(), &header)
    }

    #[test]
    fn a_journal_is_read_back_and_another_search_refused() {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("journal.jsonl");
        let results = vec![Some(0.1 + 0.2), None];
        let mut journal = open(&path, "a").unwrap();
        journal.add(&"x", Some(7), results.clone()).unwrap();
        drop(journal);
        // An incomplete last line, as after a kill.
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, [&whole[..], b"{\"asked\":\"y"].concat()).unwrap();
        let mut journal = open(&path, "a").unwrap();
        assert_eq!(journal.done(), 2);
        let batch = journal.take(&"x").unwrap().unwrap();
        assert_eq!((batch.elapsed_ms, batch.results), (Some(7), results));
        assert_eq!(journal.take(&"y").unwrap(), None);
        drop(journal);
        assert_eq!(std::fs::read(&path).unwrap(), whole);

        let other = open(&path, "a").unwrap().take(&"y").unwrap_err();
        assert!(other.to_string().contains("other runs than requested"));
        let refused = |digest: &str, part: &str| {
            let error = open(&path, digest).err().unwrap().to_string();
            assert!(error.contains(part), "{error}");
        };
        refused("b", "holds another tuning");
        let text = String::from_utf8(whole).unwrap().replace("0.3", "0.4");
        std::fs::write(&path, text).unwrap();
        refused("a", ":2: the line was changed after it was written");
    }
}
