//! The robot's own estimate of its progress on a point.

use crate::service::bus::{LEAST_LEFT_S, PointFact};

#[derive(Clone, Debug)]
pub(super) struct Progress {
    pub point: u32,
    pub round: u32,
    /// The work left at the beginning, s at skill 1.
    at_first_s: f32,
    /// The work left now, s, at least 0.
    left_s: f32,
    step_s: f32,
    /// The number of steps worked after the estimate reached 0.
    beyond: u32,
}

/// The maximum number of steps by which rounding alone can falsify the estimate.
const ROUNDING_STEPS: u32 = 2;

impl Progress {
    pub fn new(fact: &PointFact) -> Self {
        Self {
            point: fact.point,
            round: fact.round,
            at_first_s: fact.left_s,
            left_s: fact.left_s,
            step_s: 0.0,
            beyond: 0,
        }
    }

    /// Records the work of a step. Returns whether a quarter of the whole was completed.
    pub fn work(&mut self, work_s: f32) -> bool {
        let before = self.quarters();
        self.beyond += u32::from(self.left_s <= 0.0);
        self.left_s = (self.left_s - work_s).max(0.0);
        self.step_s = work_s;
        self.quarters() < before
    }

    /// Returns the work left, s. Never 0, because the point is still open.
    pub fn left_s(&self) -> f32 {
        self.left_s.max(LEAST_LEFT_S)
    }

    /// Checks whether another step would complete the point. A robot that keeps working long after that is slower than
    /// it estimates, so the estimate no longer counts.
    pub fn next_step_completes(&self) -> bool {
        self.step_s > 0.0 && self.left_s <= self.step_s && self.beyond <= ROUNDING_STEPS
    }

    /// Returns whether the robot has done all the work that was left at its first step, but for rounding.
    pub fn is_complete(&self) -> bool {
        self.at_first_s > 0.0 && self.left_s <= LEAST_LEFT_S && self.beyond <= ROUNDING_STEPS
    }

    fn quarters(&self) -> u32 {
        (4.0 * self.left_s / self.at_first_s.max(LEAST_LEFT_S)).ceil() as u32
    }
}
