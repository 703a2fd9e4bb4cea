//! The bundle and path of a robot (Choi, Brunet, How 2009, Algorithm 3). The bid for a task is its gain in the path's
//! score S(p) = Σ r·λ^(t − o), with t the time at which the unit of each task is done along p, and o the time at which
//! its window opens, 0 for an open one. The score with time windows is that of Ponda, Redding, Choi, How, Vavrina, Vian
//! (ACC 2010): a wait before the window costs nothing, and a task that cannot be done in its window has no score.

use scenario::ids::{BehaviorId, RobotId, TaskId};
use smallvec::SmallVec;

use super::winners::Winners;
use crate::allocator::utility::{DISCOUNT_PER_S, WorkInProgress};
use crate::allocator::{Choice, Input};
use crate::broken::is_broken;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    /// The index in [`Winners::tasks`].
    own: usize,
    /// The index of the entry; `None` for a task without negotiation.
    place: Option<usize>,
    value: f32,
}

/// The best behavior for a task, with its reward and cost.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Offer {
    behavior: BehaviorId,
    reward: f64,
    cost_s: f64,
    /// The time until the task's window opens, s.
    opens_in_s: f64,
    /// The utility as the next unit.
    worth: f64,
}

#[derive(Clone, Debug)]
pub struct Bundle {
    me: RobotId,
    /// L_t, the maximum number of tasks.
    most: usize,
    /// The bundle b, in the order of choice.
    held: SmallVec<[Held; 4]>,
    /// The path p, in the order of execution, as indices in [`Winners::tasks`].
    path: SmallVec<[usize; 4]>,
    /// The offer for each task at the last choice.
    offers: Vec<Option<Offer>>,
    /// True if a teammate's claim has taken the first task of the path.
    is_outbid: bool,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    held: Held,
    priority: i32,
    /// The number of tasks that stay before it in the bundle.
    after: usize,
    /// The index in the path.
    at: usize,
}

/// The part of a bundle to which a task of some priority is added.
#[derive(Clone, Debug)]
struct Stem {
    priority: i32,
    count: usize,
    path: SmallVec<[usize; 4]>,
    score: Option<f64>,
}

impl Candidate {
    fn goes_before(&self, other: &Self) -> bool {
        let key = |candidate: &Self| (candidate.priority, candidate.held.value);
        key(self) > key(other)
    }
}

impl Bundle {
    pub fn new(me: RobotId, most: usize) -> Self {
        Self {
            me,
            most,
            held: SmallVec::new(),
            path: SmallVec::new(),
            offers: Vec::new(),
            is_outbid: false,
        }
    }

    pub fn first(&self) -> Option<BehaviorId> {
        let offer = self.offers[*self.path.first()?];
        offer.map(|offer| offer.behavior)
    }

    pub fn take_outbid(&mut self) -> bool {
        std::mem::take(&mut self.is_outbid)
    }

    /// Removes the first task that the robot has lost, and all tasks chosen after it.
    pub fn drop_lost(&mut self, beliefs: &mut Winners) {
        let is_lost = |held: &Held| held.place.is_some_and(|place| !beliefs.is_mine(place));
        let Some(from) = self.held.iter().position(is_lost) else {
            return;
        };
        let first = self.path.first().copied();
        let lost = &self.held[from];
        let to_another = lost.place.is_some_and(|place| {
            let claim = beliefs.entries()[place].claim;
            claim.is_some_and(|claim| claim.robot != self.me)
        });
        self.is_outbid |= to_another && first == Some(lost.own);
        self.keep(from, beliefs);
    }

    /// Releases all but the first `count` tasks of the bundle.
    fn keep(&mut self, count: usize, beliefs: &mut Winners) {
        for held in self.held.drain(count..) {
            if let Some(place) = held.place.filter(|&place| beliefs.is_mine(place))
                && !is_broken("cbba-left-tasks-stay-claimed")
            {
                beliefs.set(place, None);
            }
        }
        let held = &self.held;
        self.path
            .retain(|own| held.iter().any(|task| task.own == *own));
    }

    /// Releases all tasks except the unit under way, and bids for that unit again at its current utility.
    pub fn replan(
        &mut self,
        keeps_first: bool,
        worths: &StepUtilities<'_, '_>,
        beliefs: &mut Winners,
    ) {
        self.weigh(worths, beliefs);
        let first = self.path.first().copied().filter(|_| keeps_first);
        let is_possible = |own: &usize| {
            let offer = self.offers[*own];
            offer.is_some_and(|offer| Some(offer.behavior) == worths.active)
        };
        let first = first.filter(is_possible);
        let kept = self.held.iter().find(|held| Some(held.own) == first);
        let kept = kept.copied();
        if let Some(kept) = kept {
            self.held.retain(|held| held.own != kept.own);
        }
        self.keep(0, beliefs);
        let Some(mut kept) = kept else { return };
        let worth = self.offers[kept.own].map_or(0.0, |offer| offer.worth);
        kept.value = bid(worth);
        if kept
            .place
            .is_some_and(|place| !beliefs.bid(place, kept.value))
        {
            self.is_outbid = true;
            return;
        }
        self.held.push(kept);
        self.path.push(kept.own);
    }

    /// Adds the task with the largest winning bid, until the bundle is full or no bid wins.
    pub fn build(
        &mut self,
        continues: bool,
        worths: &StepUtilities<'_, '_>,
        beliefs: &mut Winners,
    ) {
        self.weigh(worths, beliefs);
        // A unit under way stays first.
        let fixed = self.path.first().copied().filter(|_| continues);
        while let Some(best) = self.best(fixed, worths, beliefs) {
            self.keep(best.after, beliefs);
            let place = best.held.place;
            if place.is_some_and(|place| !beliefs.bid(place, best.held.value)) {
                continue;
            }
            self.held.push(best.held);
            self.path.insert(best.at, best.held.own);
        }
    }

    /// Returns the best winning bid. The bid for a task ignores chosen tasks of lower priority, which are dropped if it
    /// wins. Earlier choices therefore never have a lower priority or a smaller bid.
    fn best(
        &self,
        fixed: Option<usize>,
        worths: &StepUtilities<'_, '_>,
        beliefs: &Winners,
    ) -> Option<Candidate> {
        let priority_of = |own: usize| beliefs.tasks()[own].priority;
        let mut best: Option<Candidate> = None;
        let mut stem: Option<Stem> = None;
        for (own, task) in beliefs.tasks().iter().enumerate() {
            if self.offers[own].is_none() || self.path.contains(&own) {
                continue;
            }
            let known = stem.take().filter(|stem| stem.priority == task.priority);
            let stem =
                stem.insert(known.unwrap_or_else(|| self.stem(task.priority, worths, beliefs)));
            if stem.count >= self.most {
                continue;
            }
            let Some((at, gain)) = self.insertion(own, fixed, stem, worths, beliefs) else {
                continue;
            };
            // Warping: a bid is never larger than the earlier ones (Johnson, Choi, How 2012).
            let earlier = self.held[..stem.count].iter();
            let same = earlier.filter(|held| priority_of(held.own) == task.priority);
            let value = same.fold(bid(gain), |least, held| least.min(held.value));
            let Some(opening) = beliefs.winnable_place(task, value) else {
                continue;
            };
            let candidate = Candidate {
                held: Held {
                    own,
                    place: opening.place,
                    value,
                },
                priority: task.priority,
                after: stem.count,
                at,
            };
            if best.is_none_or(|best| candidate.goes_before(&best)) {
                best = Some(candidate);
            }
        }
        best
    }

    fn stem(&self, priority: i32, worths: &StepUtilities<'_, '_>, beliefs: &Winners) -> Stem {
        let is_lower = |held: &Held| beliefs.tasks()[held.own].priority < priority;
        let count = self.held.iter().position(is_lower);
        let count = count.unwrap_or(self.held.len());
        let held = &self.held[..count];
        let mut path = self.path.clone();
        path.retain(|own| held.iter().any(|task| task.own == *own));
        Stem {
            priority,
            count,
            score: self.score(&path, worths, beliefs),
            path,
        }
    }

    /// Returns the index in the path at which a task adds most, and the gain; the first of equal ones.
    fn insertion(
        &self,
        own: usize,
        fixed: Option<usize>,
        stem: &Stem,
        worths: &StepUtilities<'_, '_>,
        beliefs: &Winners,
    ) -> Option<(usize, f64)> {
        let before = stem.score?;
        let earliest = usize::from(fixed.is_some() && stem.path.first().copied() == fixed);
        let mut best: Option<(usize, f64)> = None;
        for at in earliest..=stem.path.len() {
            let mut path = stem.path.clone();
            path.insert(at, own);
            let score = self.score(&path, worths, beliefs);
            let gain = score.map(|score| score - before);
            if let Some(gain) = gain
                && best.is_none_or(|(_, most)| gain > most)
            {
                best = Some((at, gain));
            }
        }
        best
    }

    /// Computes S(p); `None` if the time of a task is not known.
    fn score(
        &self,
        path: &[usize],
        worths: &StepUtilities<'_, '_>,
        beliefs: &Winners,
    ) -> Option<f64> {
        let mut after: SmallVec<[TaskId; 4]> = SmallVec::new();
        let (mut time_s, mut score) = (0.0, 0.0);
        for &own in path {
            let offer = self.offers[own]?;
            let task = beliefs.tasks()[own].task;
            if after.is_empty() {
                time_s += offer.cost_s;
                score += offer.worth;
            } else {
                time_s += (worths.input.seconds)(&after, task)?;
                score += offer.reward * discount(time_s, offer.opens_in_s);
            }
            after.push(task);
        }
        Some(score)
    }

    /// Stores the behavior of highest utility for each task; the first of equal ones.
    fn weigh(&mut self, worths: &StepUtilities<'_, '_>, beliefs: &Winners) {
        self.offers.clear();
        self.offers.resize(beliefs.tasks().len(), None);
        for choice in worths.input.choices {
            let tasks = beliefs.tasks();
            let Ok(own) = tasks.binary_search_by_key(&choice.task, |own| own.task) else {
                continue;
            };
            let Some(offer) = worths.offer(choice) else {
                continue;
            };
            let place = &mut self.offers[own];
            if place.is_none_or(|other| offer.worth > other.worth) {
                *place = Some(offer);
            }
        }
    }

    #[cfg(test)]
    pub fn bids(&self, beliefs: &Winners) -> Vec<(TaskId, f32)> {
        let bid = |held: &Held| (beliefs.tasks()[held.own].task, held.value);
        self.held.iter().map(bid).collect()
    }

    #[cfg(test)]
    pub fn path(&self, beliefs: &Winners) -> Vec<TaskId> {
        let path = self.path.iter();
        path.map(|&own| beliefs.tasks()[own].task).collect()
    }

    #[cfg(test)]
    pub fn contains(&self, place: usize) -> bool {
        self.held.iter().any(|held| held.place == Some(place))
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
fn bid(worth: f64) -> f32 {
    // NaN is not above 0.
    if worth > 0.0 {
        (worth as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
    } else {
        f32::MIN_POSITIVE
    }
}
