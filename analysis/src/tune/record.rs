//! The runs of a search. They execute in parallel, and the journal stores their outcomes. Each search of an allocator by a
//! method has a journal of its own, so that several machines can share a tuning.

use std::collections::{HashMap, VecDeque};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::search::Method;
use super::task::Task;
use super::tuning::{Outcome, Trial, TrialExecutor};
use crate::interrupted::Interrupted;
use crate::progress::RunProgress;
use crate::sweep::lines::{LineFile, numbered_lines, parse_line};
use crate::sweep::measures::ComparisonMeasures;
use crate::sweep::run::{RunResult, execute_changed_run};
use crate::workers::run_parallel;

/// Returns the file name of the journal of a search.
#[must_use]
pub fn journal_name(allocator: &str, method: Method) -> String {
    format!("journal-{allocator}-{}.jsonl", method.slug())
}

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

/// The stored batches of a search, in the order of their requests.
pub struct SearchJournal {
    lines: LineFile,
    known: VecDeque<Batch>,
}

impl SearchJournal {
    /// Opens a journal in a folder, or starts a new one.
    ///
    /// # Errors
    /// Returns an error if the journal belongs to another search, is damaged, or cannot be written.
    pub fn open(folder: &Path, name: &str, header: &Header) -> anyhow::Result<Self> {
        let (mut lines, bytes) = LineFile::open(folder.join(name))?;
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

/// The outcomes of the defaults by allocator, condition and seed.
pub type Defaults = HashMap<(usize, usize, u64), Outcome>;

/// A journal of a merge lacks runs.
#[derive(Debug, thiserror::Error)]
#[error("{} lacks runs: its shard is not finished; finish it, and merge again", .0.display())]
pub struct Unfinished(PathBuf);

/// The executor of the trials of one search.
pub struct Executor<'w> {
    pub task: &'w Task,
    pub record: SearchJournal,
    pub jobs: NonZeroUsize,
    /// Returns true after a signal.
    pub stops: &'w (dyn Fn() -> bool + Sync),
    pub progress: &'w mut RunProgress,
    /// The runs of the defaults so far. Both searches of an allocator need them.
    pub defaults: &'w mut Defaults,
    /// True if the journal must contain all runs, as for a merge.
    pub is_complete: bool,
}

impl Executor<'_> {
    fn remember_defaults(&mut self, trials: &[Trial], outcomes: &[Outcome]) {
        let defaults = trials.iter().zip(outcomes);
        let defaults = defaults.filter(|(trial, _)| trial.values.is_none());
        self.defaults
            .extend(defaults.map(|(trial, outcome)| (defaults_key(trial), *outcome)));
    }
}

fn defaults_key(trial: &Trial) -> (usize, usize, u64) {
    (trial.allocator, trial.condition, trial.seed)
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
            self.remember_defaults(trials, &known.outcomes);
            return Ok(known.outcomes);
        }
        if self.is_complete {
            return Err(Unfinished(self.record.lines.path().to_owned()).into());
        }
        let found = trials.iter().map(|trial| match trial.values {
            None => self.defaults.get(&defaults_key(trial)).copied(),
            Some(_) => None,
        });
        let mut found: Vec<Option<Outcome>> = found.collect();
        let places = 0..trials.len();
        let places: Vec<usize> = places.filter(|place| found[*place].is_none()).collect();
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
        self.remember_defaults(trials, &batch.outcomes);
        Ok(batch.outcomes)
    }

    fn report_progress(&mut self, line: &str) {
        // A merge takes no time.
        if !self.is_complete {
            self.progress.print_line(line);
        }
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

    const JOURNAL: &str = "journal.jsonl";

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
        let mut record = SearchJournal::open(folder.path(), JOURNAL, &header("a")).unwrap();
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
        let record = SearchJournal::open(folder.path(), JOURNAL, &header("a")).unwrap();
        assert_eq!((record.done(), &record.known[0]), (2, &batch));
        drop(record);
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        let refused = |digest: &str, part: &str| {
            let error = SearchJournal::open(folder.path(), JOURNAL, &header(digest)).err();
            let error = error.unwrap().to_string();
            assert!(error.contains(part), "{error}");
        };
        refused("b", "holds another tuning");
        let text = String::from_utf8(whole).unwrap().replace("0.3", "0.4");
        std::fs::write(&path, text).unwrap();
        refused("a", ":2: the line was changed after it was written");
    }
}
