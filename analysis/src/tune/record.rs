//! The runs of a search. They execute in parallel, and the journal stores their outcomes. Each search of an allocator by a
//! method has a journal of its own, so that several machines can share a tuning.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use super::search::Method;
use super::task::Task;
use super::tuning::{Outcome, Trial, TrialExecutor};
use crate::batch_journal::BatchJournal;
use crate::interrupted::Interrupted;
use crate::progress::RunProgress;
use crate::sweep::measures::ComparisonMeasures;
use crate::sweep::run::{RunResult, execute_changed_run};
use crate::workers::run_parallel;

/// Returns the file name of the journal of a search.
#[must_use]
pub fn journal_name(allocator: &str, method: Method) -> String {
    format!("journal-{allocator}-{}.jsonl", method.slug())
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
    pub record: BatchJournal<Outcome>,
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
        if let Some(known) = self.record.take(&trials)? {
            self.remember_defaults(trials, &known.results);
            return Ok(known.results);
        }
        if self.is_complete {
            return Err(Unfinished(self.record.path().to_owned()).into());
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
        let outcomes = outcomes.ok_or(Interrupted)?;
        self.remember_defaults(trials, &outcomes);
        self.record.add(&trials, None, outcomes)
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
