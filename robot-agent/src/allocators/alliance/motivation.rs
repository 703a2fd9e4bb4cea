//! The equations 2.3 to 2.7 of the motivational behavior, one function each (docs/ALLIANCE.md §2).

use proto::telemetry::Reason;
use scenario::ids::RobotId;
use scenario::time::SimTime;

use super::history::Record;
use super::params::Params;

/// The four factors of eq. 2.7, each with the cause if it is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Factors {
    /// Eq. 2.1; the mission computes it.
    pub sensory_feedback: bool,
    /// Eq. 2.3; false while another set of the robot is active.
    pub activity_suppression: bool,
    /// Eq. 2.5; the teammate that resets the motivation.
    pub reset_by: Option<RobotId>,
    /// Eq. 2.6; the reason to yield or give up.
    pub acquiescence: Option<Reason>,
}

impl Factors {
    /// Returns the reason of the first factor that is 0.
    pub fn zero(&self) -> Option<Reason> {
        if !self.sensory_feedback {
            Some(Reason::NotApplicable)
        } else if !self.activity_suppression {
            Some(Reason::Suppressed)
        } else {
            self.reset_by.map(Reason::ResetBy).or(self.acquiescence)
        }
    }
}

/// Computes eq. 2.4 with the corrected "= 0", in motivation/s. The result is the slowest rate toward the teammates
/// received within τ and first received less than φ ago. Without such a teammate it is δ_fast.
pub(super) fn impatience(params: &Params, records: &[(RobotId, Record)], now: SimTime) -> f64 {
    let within = records
        .iter()
        .filter(|(_, record)| record.within(params.tau, now));
    within
        .filter_map(|&(teammate, ref record)| {
            let toward = params.toward(teammate)?;
            (!record.until(toward.phi, now)).then_some(toward.slow)
        })
        .min_by(f64::total_cmp)
        .unwrap_or(params.fast)
}

/// Computes eq. 2.5: returns the lowest-ranked teammate whose history on the task begins in this step.
pub(super) fn impatience_reset(records: &[(RobotId, Record)], now: SimTime) -> Option<RobotId> {
    records
        .iter()
        .find(|(_, record)| record.begins(now))
        .map(|&(teammate, _)| teammate)
}

/// Computes eq. 2.6: returns the reason why a set active since `active_since` yields or gives up.
pub(super) fn acquiescence(
    params: &Params,
    active_since: SimTime,
    records: &[(RobotId, Record)],
    now: SimTime,
) -> Option<Reason> {
    let active_for = now.since(active_since);
    let is_wanted = || {
        let mut records = records.iter();
        records.any(|(_, record)| record.within_for_acquiescence(params.tau, now))
    };
    if active_for > params.psi && is_wanted() {
        Some(Reason::AcquiescedPsi)
    } else if active_for > params.lambda {
        Some(Reason::GaveUpLambda)
    } else {
        None
    }
}

/// Computes eq. 2.7: returns the motivation in [0, θ] after a step that adds `gain`.
pub(super) fn motivation(previous: f64, gain: f64, factors: &Factors, threshold: f64) -> f64 {
    if factors.zero().is_some() {
        0.0
    } else {
        (previous + gain).min(threshold)
    }
}
