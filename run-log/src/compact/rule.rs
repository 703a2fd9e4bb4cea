//! The prediction of motivations, which writer and reader share.

use scenario::Setup;
use scenario::time::SimTime;

/// The recurrence of eq. 2.7 with the values of a run. It repeats the floating-point operations of the allocators, so
/// that a prediction has the same bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotivationRule {
    threshold: f64,
    step_s: f64,
}

impl MotivationRule {
    pub fn new(setup: &Setup) -> Self {
        Self {
            threshold: setup.alliance.threshold,
            step_s: SimTime(setup.alliance.step_ms).as_secs_f64(),
        }
    }

    /// Returns the motivation after the next step. `holds` states that the latest step did not change the motivation:
    /// then it stays, for example because it is at the threshold or because learning withholds it.
    pub fn next(&self, motivation: f64, rate: f64, factors: bool, holds: bool) -> f64 {
        if holds {
            motivation
        } else if factors {
            (motivation + rate * self.step_s).min(self.threshold)
        } else {
            0.0
        }
    }
}
