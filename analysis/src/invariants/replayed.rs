//! Invariant: a replay gives the same run.

use run_log::{LogLevel, RunLog};
use scenario::ids::Tick;

use super::{Invariant, Violation};
use crate::replay::replay;

/// Replays a finished run from its log, and compares the run hash, the outcome and all figures.
///
/// # Errors
/// Returns an error when they differ or the log contains an invalid input.
pub fn check(logged: &RunLog) -> anyhow::Result<()> {
    let (_, again) = replay(logged, LogLevel::Off, |_| {})?;
    let (run, other) = (&logged.run, &again.run);
    let tick: Tick = run.result.ticks;
    let different = |what: String| Violation {
        invariant: Invariant::ReplayIdentical,
        tick,
        description: what,
    };
    if run.hash != other.hash {
        let hash = |hash: &Option<String>| hash.clone().unwrap_or_default();
        let what = format!(
            "the hash is {}, and {} in the replay",
            hash(&run.hash),
            hash(&other.hash)
        );
        return Err(different(what).into());
    }
    if (run.outcome, &run.result, &run.faults) != (other.outcome, &other.result, &other.faults) {
        let what = "outcome, result or faults differ in the replay".to_owned();
        return Err(different(what).into());
    }
    Ok(())
}
