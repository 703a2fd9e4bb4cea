//! The equations of the motivational behavior, one function each (ALLIANCE.md §2).

use alliance_proto::ids::RobotId;
use alliance_proto::telemetry::Reason;
use alliance_proto::time::SimTime;

use super::history::Record;
use super::params::Params;

/// The four factors of eq. 2.7, each with the cause that makes it 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Factors {
    /// Eq. 2.1, given by the mission.
    pub sensory_feedback: bool,
    /// Eq. 2.3: no other set of the robot is active.
    pub activity_suppression: bool,
    /// Eq. 2.5: the teammate that resets the motivation.
    pub reset_by: Option<RobotId>,
    /// Eq. 2.6: why the set yields or gives up.
    pub acquiescence: Option<Reason>,
}

impl Factors {
    /// The first factor that is 0, as the reason for what follows from it.
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

/// Eq. 2.4, with the corrected "= 0": motivation/s. The slowest rate toward those who were heard within τ and not yet
/// before φ; δ_fast if there is none.
pub(super) fn impatience(params: &Params, heard: &[(RobotId, Record)], now: SimTime) -> f64 {
    let within = heard
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

/// Eq. 2.5: the teammate of the lowest rank whose history on the task begins in this step.
pub(super) fn impatience_reset(heard: &[(RobotId, Record)], now: SimTime) -> Option<RobotId> {
    heard
        .iter()
        .find(|(_, record)| record.begins(now))
        .map(|&(teammate, _)| teammate)
}

/// Eq. 2.6: why a set that has been active since `active_since` yields or gives up, if it does.
pub(super) fn acquiescence(
    params: &Params,
    active_since: SimTime,
    heard: &[(RobotId, Record)],
    now: SimTime,
) -> Option<Reason> {
    let active_for = now.since(active_since);
    let is_wanted = || {
        let mut records = heard.iter();
        records.any(|(_, record)| record.wanted_within(params.tau, now))
    };
    if active_for > params.psi && is_wanted() {
        Some(Reason::AcquiescedPsi)
    } else if active_for > params.lambda {
        Some(Reason::GaveUpLambda)
    } else {
        None
    }
}

/// Eq. 2.7: the motivation after a step in which `gain` was added, in [0, θ].
pub(super) fn motivation(previous: f64, gain: f64, factors: &Factors, threshold: f64) -> f64 {
    if factors.zero().is_some() {
        0.0
    } else {
        (previous + gain).min(threshold)
    }
}
