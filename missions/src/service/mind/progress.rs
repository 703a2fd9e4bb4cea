//! How far a robot has come with a point, by its own reckoning.

use crate::service::bus::{Fact, LEAST_LEFT_S};

#[derive(Clone, Debug)]
pub(super) struct Progress {
    pub point: u16,
    pub round: u16,
    /// Work left when it began, s of a robot of skill 1.
    at_first_s: f32,
    /// Work left now, s; no less than 0.
    left_s: f32,
    /// What a step takes off, s.
    step_s: f32,
    /// Steps that it has worked since nothing should be left.
    beyond: u32,
}

/// So many steps at most its reckoning is off for its rounding alone.
const ROUNDING_STEPS: u32 = 2;

impl Progress {
    pub fn new(fact: &Fact) -> Self {
        Self {
            point: fact.point,
            round: fact.round,
            at_first_s: fact.left_s,
            left_s: fact.left_s,
            step_s: 0.0,
            beyond: 0,
        }
    }

    /// A step's work is done; whether a quarter of all of it is.
    pub fn work(&mut self, work_s: f32) -> bool {
        let before = self.quarters();
        self.beyond += u32::from(self.left_s <= 0.0);
        self.left_s = (self.left_s - work_s).max(0.0);
        self.step_s = work_s;
        self.quarters() < before
    }

    /// Work left, s; of what is still open never 0.
    pub fn left_s(&self) -> f32 {
        self.left_s.max(LEAST_LEFT_S)
    }

    /// Whether another step like the last would have ended it. Whoever works on beyond that takes less off than it knows.
    pub fn is_at_its_end(&self) -> bool {
        self.step_s > 0.0 && self.left_s <= self.step_s && self.beyond <= ROUNDING_STEPS
    }

    fn quarters(&self) -> u32 {
        // Not above 4.
        (4.0 * self.left_s / self.at_first_s.max(LEAST_LEFT_S)).ceil() as u32
    }
}
