//! The runs of a search. They execute in parallel, and the journal stores their outcomes.

use std::collections::VecDeque;
use std::num::NonZeroUsize;
use std::path::Path;

use anyhow::{anyhow, bail};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::task::Task;
use super::tuning::{Outcome, Trial, TrialExecutor};
use crate::interrupted::Interrupted;
use crate::progress::RunProgress;
use crate::sweep::lines::{LineFile, numbered_lines, parse_line};
use crate::sweep::measures::ComparisonMeasures;
use crate::sweep::run::{RunResult, execute_changed_run};
use crate::workers::run_parallel;

const JOURNAL: &str = "journal.jsonl";

/// The first line of the journal, which identifies the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    pub tune: String,
    pub version: String,
    /// The digest of the plan ([`crate::sweep::Plan::digest`]).
    pub digest: String,
}

/// A line of the journal: the outcomes of trials that were requested together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Batch {
    asked: String,
    outcomes: Vec<Outcome>,
}

/// The stored batches, in the order of their requests.
pub struct SearchJournal {
    lines: LineFile,
    known: VecDeque<Batch>,
}

impl SearchJournal {
    /// Opens the journal of a folder, or starts a new one.
    ///
    /// # Errors
    /// Returns an error if the journal belongs to another search, is damaged, or cannot be written.
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
                    "{} holds another tuning, or this one before it was changed; name a new folder with --out, or remove that folder",
                    folder.display()
                );
            }
        }
        if bytes.is_empty() {
            lines.add(header)?;
        }
        Ok(Self { lines, known })
    }

    #[must_use]
    pub fn done(&self) -> usize {
        self.known.iter().map(|batch| batch.outcomes.len()).sum()
    }
}

/// The executor of a search's trials.
pub struct Executor<'w> {
    pub task: &'w Task,
    pub record: SearchJournal,
    pub jobs: NonZeroUsize,
    /// Returns true after a signal.
    pub stops: &'w (dyn Fn() -> bool + Sync),
    pub progress: RunProgress,
}

impl TrialExecutor for Executor<'_> {
    fn run(&mut self, trials: &[Trial]) -> anyhow::Result<Vec<Outcome>> {
        let digest = format!("{:016x}", xxh3_64(format!("{trials:?}").as_bytes()));
        if let Some(known) = self.record.known.pop_front() {
            if known.asked != digest {
                bail!(
                    "{} contains other runs than requested; remove it to start again",
                    self.record.lines.path().display()
                );
            }
            return Ok(known.outcomes);
        }
        let places: Vec<usize> = (0..trials.len()).collect();
        let mut found: Vec<Option<Outcome>> = vec![None; trials.len()];
        let task = self.task;
        let attempt = |place: usize, stops: &dyn Fn() -> bool| {
            let Trial {
                allocator,
                values,
                condition,
                seed,
            } = &trials[place];
            let changes = task.allocators[*allocator].changes(values.as_deref());
            let end = execute_changed_run(&task.plan, *condition, &changes, *seed, stops)?;
            Some((place, outcome(task, *condition, &end)))
        };
        let (jobs, stops) = (self.jobs, self.stops);
        run_parallel(&places, jobs, stops, attempt, |(place, outcome)| {
            self.progress.add(outcome.value.is_none());
            found[place] = Some(outcome);
            Ok(())
        })?;
        let outcomes: Option<Vec<Outcome>> = found.into_iter().collect();
        let batch = Batch {
            asked: digest,
            outcomes: outcomes.ok_or(Interrupted)?,
        };
        self.record.lines.add(&batch)?;
        Ok(batch.outcomes)
    }

    fn report_progress(&mut self, line: &str) {
        self.progress.print_line(line);
    }
}

fn outcome(task: &Task, condition: usize, end: &RunResult) -> Outcome {
    let RunResult::Ended(figures) = end else {
        return Outcome::default();
    };
    let measures = ComparisonMeasures {
        limit_s: task.conditions[condition].limit_s,
        ..ComparisonMeasures::default()
    };
    Outcome {
        value: task.metric.of(figures, &measures),
        bytes: figures.bytes_sent as f64,
    }
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    fn header(digest: &str) -> Header {
        Header {
            tune: "t".to_owned(),
            version: "1".to_owned(),
            digest: digest.to_owned(),
        }
    }

    #[test]
    fn a_record_is_read_back_and_another_search_refused() {
        let folder = TempDir::new().unwrap();
        let mut record = SearchJournal::open(folder.path(), &header("a")).unwrap();
        let batch = Batch {
            asked: "x".to_owned(),
            outcomes: vec![
                Outcome {
                    value: Some(0.1 + 0.2),
                    bytes: 7.0,
                },
                Outcome::default(),
            ],
        };
        record.lines.add(&batch).unwrap();
        drop(record);
        // An incomplete last line, as after a kill.
        let path = folder.path().join(JOURNAL);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, [&whole[..], b"{\"asked\":\"y"].concat()).unwrap();
        let record = SearchJournal::open(folder.path(), &header("a")).unwrap();
        assert_eq!((record.done(), &record.known[0]), (2, &batch));
        drop(record);
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        let refused = |digest: &str, part: &str| {
            let error = SearchJournal::open(folder.path(), &header(digest)).err();
            let error = error.unwrap().to_string();
            assert!(error.contains(part), "{error}");
        };
        refused("b", "holds another tuning");
        let text = String::from_utf8(whole).unwrap().replace("0.3", "0.4");
        std::fs::write(&path, text).unwrap();
        refused("a", ":2: the line was changed after it was written");
    }
}
