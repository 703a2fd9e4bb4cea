//! A finished run before the eyes: run again from its log, with a view of it at each tick.
//!
//! A log says how the run came about, not where every item lay: scenario, seed and inputs give that back (DESIGN §5), whatever
//! its tables hold.

use alliance_proto::log::{LogLevel, RunLog, RunOutcome};
use alliance_proto::view::View;

use crate::replay::replay;

/// A run that was run again.
pub struct Retraced {
    /// The log of the second time.
    pub log: RunLog,
    /// Why that is not what the first one logged; `None`: it is, to the byte.
    pub differs: Option<String>,
}

/// Runs a logged run again, for as many ticks as its log is whole. `see` gets a view before the first tick and after each.
///
/// # Errors
/// When the log has no whole tick, or holds what is no input.
pub fn retrace(
    logged: &RunLog,
    level: LogLevel,
    mut see: impl FnMut(View),
) -> anyhow::Result<Retraced> {
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
            "this program does not repeat the logged run{versions} exactly: `alliance replay` names the difference"
        )
    });
    Ok(Retraced { log, differs })
}
