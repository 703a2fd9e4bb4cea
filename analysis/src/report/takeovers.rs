//! The takeovers after the loss of a robot, as lines for the end of a run.

use std::fs;
use std::path::Path;

use run_log::{LogLevel, RunFile, RunLog};
use scenario::Vocabulary;

use super::history::{History, HistoryError};
use super::metrics::Metrics;

/// The largest team for which a run reads its log again. Larger logs take seconds.
const MAX_ROBOTS: usize = 30;

/// Returns a line for each takeover from a lost robot, in order of time. There are none without a full log, without a
/// loss, and for teams of more than `MAX_ROBOTS`.
#[must_use]
pub fn takeover_lines(folder: &Path, run: &RunFile, vocabulary: &Vocabulary) -> Vec<String> {
    let is_small = run.setup.scenario.robots.len() <= MAX_ROBOTS;
    let events = fs::read_to_string(folder.join("events.csv")).unwrap_or_default();
    if run.log != LogLevel::Full || !is_small || !events.contains(",gone,") {
        return Vec::new();
    }
    let log = RunLog::open(folder, vocabulary).map_err(HistoryError::from);
    let Ok(history) = log.and_then(|log| History::read(&log)) else {
        return Vec::new();
    };
    let robot = |rank: usize| history.setup.scenario.robots[rank].name.as_str();
    let takeovers = Metrics::compute(&history, run).takeovers.into_iter();
    let lost = takeovers.filter(|takeover| takeover.cause.is_loss());
    lost.map(|takeover| {
        format!(
            "{}: {} took over {} from {}, {} after its loss",
            takeover.at,
            robot(takeover.robot),
            history.catalog.tasks[takeover.task.index()].name,
            robot(takeover.from),
            takeover.at.since(takeover.idle_since),
        )
    })
    .collect()
}
