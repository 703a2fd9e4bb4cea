//! The bundle and path of a robot (Choi, Brunet, How 2009, Algorithm 3). The bid for a task is its gain in the path's
//! score.

#[cfg(test)]
use scenario::ids::TaskId;
use scenario::ids::{BehaviorId, RobotId};
use smallvec::SmallVec;

use super::score::{Offer, Scores, StepUtilities, bid};
use crate::allocators::consensus::winners::Winners;
use crate::broken::is_broken;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    /// The index in [`Winners::tasks`].
    own: usize,
    /// The index of the entry; `None` for a task without negotiation.
    place: Option<usize>,
    value: f32,
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

    /// Adds the task with the largest winning bid, until the bundle is full or no bid wins. Tasks that `is_left` marks are
    /// left to teammates.
    pub fn build(
        &mut self,
        continues: bool,
        worths: &StepUtilities<'_, '_>,
        beliefs: &mut Winners,
        is_left: impl Fn(usize) -> bool,
    ) {
        self.weigh(worths, beliefs);
        // A unit under way stays first.
        let fixed = self.path.first().copied().filter(|_| continues);
        while let Some(best) = self.best(fixed, worths, beliefs, &is_left) {
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
        is_left: impl Fn(usize) -> bool,
    ) -> Option<Candidate> {
        let priority_of = |own: usize| beliefs.tasks()[own].priority;
        let mut best: Option<Candidate> = None;
        let mut stem: Option<Stem> = None;
        for (own, task) in beliefs.tasks().iter().enumerate() {
            if self.offers[own].is_none() || self.path.contains(&own) || is_left(own) {
                continue;
            }
            let known = stem.take().filter(|stem| stem.priority == task.priority);
            let stem =
                stem.insert(known.unwrap_or_else(|| self.stem(task.priority, worths, beliefs)));
            if stem.count >= self.most {
                continue;
            }
            let is_fixed = fixed.is_some() && stem.path.first().copied() == fixed;
            let scores = self.scores(worths, beliefs);
            let gain = stem.score.and_then(|before| {
                scores.insertion(&stem.path, own, usize::from(is_fixed), before)
            });
            let Some((at, gain)) = gain else { continue };
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
            score: self.scores(worths, beliefs).score(&path),
            path,
        }
    }

    fn scores<'a>(&'a self, worths: &'a StepUtilities<'_, '_>, beliefs: &'a Winners) -> Scores<'a> {
        Scores {
            offers: &self.offers,
            tasks: beliefs.tasks(),
            seconds: worths.input.seconds,
        }
    }

    fn weigh(&mut self, worths: &StepUtilities<'_, '_>, beliefs: &Winners) {
        worths.offers(beliefs.tasks(), &mut self.offers);
    }

    /// Returns the path, and the bids in the order of choice; tasks are indices in [`Winners::tasks`].
    pub fn plan(&self) -> (&[usize], impl Iterator<Item = (usize, f32)>) {
        let bids = self.held.iter().map(|held| (held.own, held.value));
        (&self.path, bids)
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
