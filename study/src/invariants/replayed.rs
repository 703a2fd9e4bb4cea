//! A run from its inputs is the same run.

use alliance_proto::ids::Tick;
use alliance_proto::log::{LogLevel, RunLog};

use super::{Invariant, Violation};
use crate::replay::replay;

/// Runs a run that has ended again from its log, and compares the hashes of all ticks together, and all figures.
///
/// # Errors
/// When they differ, or the log holds what is no input.
pub fn check(logged: &RunLog) -> anyhow::Result<()> {
    let (_, again) = replay(logged, LogLevel::Off, |_| {})?;
    let (run, other) = (&logged.run, &again.run);
    let tick: Tick = run.result.ticks;
    let different = |what: String| Violation {
        invariant: Invariant::ReplayIdentical,
        tick,
        what,
    };
    if run.hash != other.hash {
        let hash = |hash: &Option<String>| hash.clone().unwrap_or_default();
        let what = format!(
            "the hash is {}, and {} when it is run again",
            hash(&run.hash),
            hash(&other.hash)
        );
        return Err(different(what).into());
    }
    if (&run.result, &run.faults) != (&other.result, &other.faults) {
        let what = "result or faults differ when it is run again".to_owned();
        return Err(different(what).into());
    }
    Ok(())
}
