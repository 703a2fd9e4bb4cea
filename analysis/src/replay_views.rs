//! Replay of a finished run with a view of each tick.
//!
//! A log does not contain the position of every item. Scenario, seed and inputs reproduce it at any log level.

use proto::view::View;
use run_log::recorder::Sink;
use run_log::{LogLevel, RunFile, RunLog, RunOutcome};
use world_server::simulation::Simulation;

use crate::replay::team_at_end;

/// The result of a replay into a sink.
pub struct ReplayIntoSink<S> {
    pub run: RunFile,
    pub sink: S,
    /// The last view, without messages and curves.
    pub end: View,
    /// The difference from the logged run; `None` if the replay is identical to the byte.
    pub differs: Option<String>,
}

/// Replays a logged run up to its last complete tick, and writes its log at `level` to a sink. `see` is called before the
/// first tick and after each tick. It can create views when it needs them: a view of a large team takes longer than a tick.
///
/// # Errors
/// Returns an error when the log has no complete tick or contains an invalid input, and the errors of the sink.
pub fn retrace_into<S: Sink>(
    logged: &RunLog,
    level: LogLevel,
    sink: S,
    see: impl FnMut(&mut Simulation),
) -> anyhow::Result<ReplayIntoSink<S>> {
    let (team, outcome) = team_at_end(logged, level, sink, see)?;
    let end = team.view();
    let (run, recorder) = team.end(outcome)?;
    let first = match logged.run.outcome {
        RunOutcome::Ended(_) => logged.run.hash.clone(),
        RunOutcome::Running => logged.last.map(|seal| format!("{:016x}", seal.hash)),
    };
    let differs = (first != run.hash).then(|| {
        let (this, other) = (&run.version, &logged.run.version);
        let versions = if this == other {
            String::new()
        } else {
            format!(" (version {other}; this is {this})")
        };
        format!(
            "this program does not reproduce the logged run{versions} exactly; `alliance replay` shows the difference"
        )
    });
    Ok(ReplayIntoSink {
        run,
        sink: recorder.into_sink(),
        end,
        differs,
    })
}
