//! The takeovers after the loss of a robot, for the end of a run and for its page.

use std::fmt;
use std::fs;
use std::path::Path;

use run_log::{LogLevel, RunFile, RunLog};
use scenario::Vocabulary;
use scenario::time::SimTime;

use super::history::{History, HistoryError};
use super::metrics::Metrics;

/// The largest team whose log is read again. Larger logs take seconds.
const MAX_ROBOTS: usize = 30;

/// A task that a robot took over from a lost one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LossTakeover {
    pub at: SimTime,
    pub robot: String,
    pub task: String,
    /// The lost robot that executed the task before.
    pub from: String,
    /// The time since its loss.
    pub after: SimTime,
}

impl fmt::Display for LossTakeover {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            at,
            robot,
            task,
            from,
            after,
        } = self;
        write!(
            f,
            "{at}: {robot} took over {task} from {from}, {after} after its loss"
        )
    }
}

/// Returns the takeovers from lost robots, in order of time. There are none without a full log, without a loss, and for
/// teams of more than `MAX_ROBOTS`.
#[must_use]
pub fn loss_takeovers(folder: &Path, run: &RunFile, vocabulary: &Vocabulary) -> Vec<LossTakeover> {
    let is_small = run.setup.scenario.robots.len() <= MAX_ROBOTS;
    let events = fs::read_to_string(folder.join("events.csv")).unwrap_or_default();
    if run.log != LogLevel::Full || !is_small || !events.contains(",gone,") {
        return Vec::new();
    }
    let log = RunLog::open(folder, vocabulary).map_err(HistoryError::from);
    let Ok(history) = log.and_then(|log| History::read(&log)) else {
        return Vec::new();
    };
    let robot = |rank: usize| history.setup.scenario.robots[rank].name.clone();
    let takeovers = Metrics::compute(&history, run).takeovers.into_iter();
    let lost = takeovers.filter(|takeover| takeover.cause.is_loss());
    lost.map(|takeover| LossTakeover {
        at: takeover.at,
        robot: robot(takeover.robot),
        task: history.catalog.tasks[takeover.task.index()].name.clone(),
        from: robot(takeover.from),
        after: takeover.at.since(takeover.idle_since),
    })
    .collect()
}
