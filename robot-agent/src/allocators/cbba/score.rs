//! The score of a path: S(p) = Σ r·λ^(t − o), with t the time at which the unit of each task is done along p, and o the
//! time at which its window opens, 0 for an open one. The score with time windows is that of Ponda, Redding, Choi, How,
//! Vavrina, Vian (ACC 2010): a wait before the window costs nothing, and a task that cannot be done in its window has no
//! score.

use scenario::ids::{BehaviorId, TaskId};
use smallvec::SmallVec;

use crate::allocator::utility::{DISCOUNT_PER_S, WorkInProgress};
use crate::allocator::{Choice, Input};
use crate::allocators::consensus::winners::OwnTask;

/// The best behavior for a task, with its reward and cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offer {
    pub behavior: BehaviorId,
    pub reward: f64,
    pub cost_s: f64,
    /// The time until the task's window opens, s.
    pub opens_in_s: f64,
    /// The utility as the next unit.
    pub worth: f64,
}

/// The values for the scores of one robot's paths. Paths contain indices of tasks.
#[derive(Clone, Copy)]
pub struct Scores<'a> {
    pub offers: &'a [Option<Offer>],
    pub tasks: &'a [OwnTask],
    /// The function of [`Input::seconds`].
    pub seconds: &'a dyn Fn(&[TaskId], TaskId) -> Option<f64>,
}

impl Scores<'_> {
    /// Returns the index in the path, from `earliest` on, at which a task adds most, and the gain; the first of equal
    /// ones. `before` is the score of the path without the task.
    pub fn insertion(
        &self,
        path: &[usize],
        own: usize,
        earliest: usize,
        before: f64,
    ) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        for at in earliest..=path.len() {
            let mut with: SmallVec<[usize; 4]> = path.into();
            with.insert(at, own);
            let gain = self.score(&with).map(|score| score - before);
            if let Some(gain) = gain
                && best.is_none_or(|(_, most)| gain > most)
            {
                best = Some((at, gain));
            }
        }
        best
    }

    /// Computes S(p); `None` if the time of a task is not known.
    pub fn score(&self, path: &[usize]) -> Option<f64> {
        let mut after: SmallVec<[TaskId; 4]> = SmallVec::new();
        let (mut time_s, mut score) = (0.0, 0.0);
        for &own in path {
            let offer = self.offers[own]?;
            let task = self.tasks[own].task;
            if after.is_empty() {
                time_s += offer.cost_s;
                score += offer.worth;
            } else {
                time_s += (self.seconds)(&after, task)?;
                score += offer.reward * discount(time_s, offer.opens_in_s);
            }
            after.push(task);
        }
        Some(score)
    }
}

/// The inputs for the utilities of one step.
pub struct StepUtilities<'a, 'i> {
    pub input: &'a Input<'i>,
    /// The unit under way, once its work has started; see [`crate::allocator::unit`].
    pub begun: WorkInProgress,
    /// The behavior that was active before the step.
    pub active: Option<BehaviorId>,
}

impl StepUtilities<'_, '_> {
    /// Writes the behavior of highest utility for each task; the first of equal ones.
    pub fn offers(&self, tasks: &[OwnTask], offers: &mut Vec<Option<Offer>>) {
        offers.clear();
        offers.resize(tasks.len(), None);
        for choice in self.input.choices {
            let Ok(own) = tasks.binary_search_by_key(&choice.task, |own| own.task) else {
                continue;
            };
            let Some(offer) = self.offer(choice) else {
                continue;
            };
            let place = &mut offers[own];
            if place.is_none_or(|other| offer.worth > other.worth) {
                *place = Some(offer);
            }
        }
    }

    fn offer(&self, choice: &Choice) -> Option<Offer> {
        let (utility, cost_s) = (self.begun.utility(choice, self.input)?, choice.cost_s?);
        let opens_in_s = choice.opens_in_s;
        let worth = if opens_in_s > 0.0 {
            // The utility of a unit under way is not discounted.
            utility.max(choice.reward * discount(cost_s, opens_in_s))
        } else {
            utility
        };
        Some(Offer {
            behavior: choice.behavior,
            reward: choice.reward,
            opens_in_s,
            worth,
            cost_s,
        })
    }
}

/// Returns λ^(t − o) for a task that is done at the time t and whose window opens at o, both from now, s.
fn discount(done_s: f64, opens_in_s: f64) -> f64 {
    libm::pow(DISCOUNT_PER_S, (done_s - opens_in_s).max(0.0))
}

/// Converts a utility to a finite bid above 0 for any mission; 0 stands for no bid.
pub fn bid(worth: f64) -> f32 {
    // NaN is not above 0.
    if worth > 0.0 {
        (worth as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
    } else {
        f32::MIN_POSITIVE
    }
}
