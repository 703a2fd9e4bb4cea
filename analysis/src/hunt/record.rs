//! The runs of a hunt. They execute in parallel, and the journal stores their judgements by batch.

use std::num::NonZeroUsize;

use tokio::time::Instant;

use super::case::{Case, Conditions, Judge, Judgement};
use super::judge::judge;
use crate::batch_journal::BatchJournal;
use crate::interrupted::Interrupted;
use crate::progress::RunProgress;
use crate::workers::run_parallel;

/// The file of the judgements of all runs.
pub const JOURNAL: &str = "journal.jsonl";

/// The executor of a hunt's runs.
pub struct Executor<'w> {
    pub record: BatchJournal<Judgement>,
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
        let request = (conditions, cases);
        if let Some(known) = self.record.take(&request)? {
            self.elapsed_ms += known.elapsed_ms.unwrap_or_default();
            return Ok(known.results);
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
        let judged = judged.ok_or(Interrupted)?;
        self.elapsed_ms += elapsed_ms;
        let elapsed_ms = self.is_timed.then_some(elapsed_ms);
        self.record.add(&request, elapsed_ms, judged)
    }

    fn elapsed_s(&self) -> f64 {
        self.elapsed_ms as f64 / 1000.0
    }

    fn note(&mut self, line: &str) {
        self.progress.print_line(line);
    }
}
