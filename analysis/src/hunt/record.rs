//! The runs of a hunt. They execute in parallel, and the journal stores their judgements by batch.

use std::collections::VecDeque;
use std::num::NonZeroUsize;
use std::path::Path;

use anyhow::{anyhow, bail};
use serde::{Deserialize, Serialize};
use tokio::time::Instant;
use xxhash_rust::xxh3::xxh3_64;

use super::case::{Case, Conditions, Judge, Judgement};
use super::judge::judge;
use crate::interrupted::Interrupted;
use crate::progress::RunProgress;
use crate::sweep::lines::{LineFile, numbered_lines, parse_line};
use crate::workers::run_parallel;

const JOURNAL: &str = "journal.jsonl";

/// The first line of the journal, which identifies the hunt.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    pub hunt: String,
    pub version: String,
    /// The digest of the plan ([`super::plan::HuntPlan::digest`]).
    pub digest: String,
}

/// A line of the journal: the judgements of cases that were requested together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Batch {
    asked: String,
    /// The wall-clock time of the batch, if the budget is a time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    elapsed_ms: Option<u64>,
    judged: Vec<Judgement>,
}

/// The stored batches, in the order of their requests.
pub struct HuntJournal {
    lines: LineFile,
    known: VecDeque<Batch>,
}

impl HuntJournal {
    /// Opens the journal of a folder, or starts a new one.
    ///
    /// # Errors
    /// Returns an error if the journal belongs to another hunt, is damaged, or cannot be written.
    pub fn open(folder: &Path, header: &Header) -> anyhow::Result<Self> {
        let (mut lines, bytes) = LineFile::open(folder.join(JOURNAL))?;
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
                    "{} holds another hunt, or this one before it was changed; name a new folder with --out, or remove that folder",
                    folder.display()
                );
            }
        }
        if bytes.is_empty() {
            lines.add(header)?;
        }
        Ok(Self { lines, known })
    }

    /// Returns the number of stored runs.
    #[must_use]
    pub fn done(&self) -> usize {
        self.known.iter().map(|batch| batch.judged.len()).sum()
    }
}

/// The executor of a hunt's runs.
pub struct Executor<'w> {
    pub record: HuntJournal,
    pub jobs: NonZeroUsize,
    /// Returns true after a signal.
    pub stops: &'w (dyn Fn() -> bool + Sync),
    pub progress: RunProgress,
    /// True if the budget is a time, so that the journal stores the times of batches.
    pub is_timed: bool,
    pub elapsed_ms: u64,
}

impl Judge for Executor<'_> {
    fn judge(&mut self, cases: &[Case], conditions: &Conditions) -> anyhow::Result<Vec<Judgement>> {
        let asked = format!("{conditions:?}\n{cases:?}");
        let asked = format!("{:016x}", xxh3_64(asked.as_bytes()));
        if let Some(known) = self.record.known.pop_front() {
            if known.asked != asked {
                bail!(
                    "{} contains other runs than requested; remove it to start again",
                    self.record.lines.path().display()
                );
            }
            self.elapsed_ms += known.elapsed_ms.unwrap_or_default();
            return Ok(known.judged);
        }
        let began = Instant::now();
        let places: Vec<usize> = (0..cases.len()).collect();
        let mut found: Vec<Option<Judgement>> = vec![None; cases.len()];
        let attempt = |place: usize, stops: &dyn Fn() -> bool| {
            Some((place, judge(&cases[place], conditions, stops)?))
        };
        run_parallel(
            &places,
            self.jobs,
            self.stops,
            attempt,
            |(place, judgement)| {
                self.progress.add(false);
                found[place] = Some(judgement);
                Ok(())
            },
        )?;
        let judged: Option<Vec<Judgement>> = found.into_iter().collect();
        let elapsed_ms = began.elapsed().as_millis() as u64;
        let batch = Batch {
            asked,
            elapsed_ms: self.is_timed.then_some(elapsed_ms),
            judged: judged.ok_or(Interrupted)?,
        };
        self.elapsed_ms += elapsed_ms;
        self.record.lines.add(&batch)?;
        Ok(batch.judged)
    }

    fn elapsed_s(&self) -> f64 {
        self.elapsed_ms as f64 / 1000.0
    }

    fn note(&mut self, line: &str) {
        self.progress.print_line(line);
    }
}

#[cfg(test)]
mod tests {
    use scenario::time::SimTime;
    use tempfile::TempDir;

    use super::super::violation::{FoundViolation, ViolationKind};
    use super::*;

    fn header(digest: &str) -> Header {
        Header {
            hunt: "h".to_owned(),
            version: "1".to_owned(),
            digest: digest.to_owned(),
        }
    }

    #[test]
    fn a_record_is_read_back_and_another_hunt_refused() {
        let folder = TempDir::new().unwrap();
        let mut record = HuntJournal::open(folder.path(), &header("a")).unwrap();
        let judgement = Judgement {
            violation: Some(FoundViolation {
                kind: ViolationKind::Termination,
                at_ms: SimTime(7),
                description: "2 items are left".to_owned(),
            }),
            states: vec![1, u32::MAX],
            ..Judgement::default()
        };
        let batch = Batch {
            asked: "x".to_owned(),
            elapsed_ms: None,
            judged: vec![judgement, Judgement::default()],
        };
        record.lines.add(&batch).unwrap();
        drop(record);
        // An incomplete last line, as after a kill.
        let path = folder.path().join(JOURNAL);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, [&whole[..], b"{\"asked\":\"y"].concat()).unwrap();
        let record = HuntJournal::open(folder.path(), &header("a")).unwrap();
        assert_eq!((record.done(), &record.known[0]), (2, &batch));
        drop(record);
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        let refused = |digest: &str, part: &str| {
            let error = HuntJournal::open(folder.path(), &header(digest)).err();
            let error = error.unwrap().to_string();
            assert!(error.contains(part), "{error}");
        };
        refused("b", "holds another hunt");
        let text = String::from_utf8(whole)
            .unwrap()
            .replace("\"at_ms\":7", "\"at_ms\":8");
        std::fs::write(&path, text).unwrap();
        refused("a", ":2: the line was changed after it was written");
    }
}
