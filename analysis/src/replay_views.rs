//! Replay of a finished run with a view of each tick.
//!
//! A log does not contain the position of every item. Scenario, seed and inputs reproduce it at any log level.

use proto::view::View;
use run_log::{LogLevel, RunLog, RunOutcome};

use crate::replay::replay;

/// The result of a replay with views.
pub struct ReplayWithViews {
    pub log: RunLog,
    /// The difference from the logged run; `None` if the replay is identical to the byte.
    pub differs: Option<String>,
}

/// Replays a logged run up to its last complete tick. `see` receives a view before the first tick and after each tick.
///
/// # Errors
/// Returns an error when the log has no complete tick or contains an invalid input.
pub fn retrace(
    logged: &RunLog,
    level: LogLevel,
    mut see: impl FnMut(View),
) -> anyhow::Result<ReplayWithViews> {
    let (_, log) = replay(logged, level, |simulation| see(simulation.view()))?;
    let (first, again) = match logged.run.outcome {
        RunOutcome::Ended(_) => (logged.run.hash.clone(), log.run.hash.clone()),
        RunOutcome::Running => {
            let hash = |log: &RunLog| log.last.map(|seal| format!("{:016x}", seal.hash));
            (hash(logged), hash(&log))
        }
    };
    let differs = (first != again).then(|| {
        let (this, other) = (&log.run.version, &logged.run.version);
        let versions = if this == other {
            String::new()
        } else {
            format!(" (version {other}; this is {this})")
        };
        format!(
            "this program does not reproduce the logged run{versions} exactly; `alliance replay` shows the difference"
        )
    });
    Ok(ReplayWithViews { log, differs })
}
