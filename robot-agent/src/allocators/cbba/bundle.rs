//! A robot's bundle and path: which tasks it has chosen, in which order it will do them, and the bids that it makes for them (Choi,
//! Brunet, How 2009, Algorithm 3). A task's bid is what it adds to the score of the path; the score is S(p) = Σ r·λ^t, with t the time
//! until the unit of each task is done along p.

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use smallvec::SmallVec;

use super::beliefs::Beliefs;
use crate::allocator::utility::{DISCOUNT_PER_S, UnderWay};
use crate::allocator::{Choice, Input};

/// A task that the robot has chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    /// Place in [`Beliefs::tasks`].
    own: usize,
    /// Its entry; `None` where nothing is negotiated.
    place: Option<usize>,
    value: f32,
}

/// What the robot can do for a task, and what that is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Offer {
    behavior: BehaviorId,
    reward: f64,
    cost_s: f64,
    /// What it is worth as the next unit.
    worth: f64,
}

/// What a robot has chosen, and how it bids.
#[derive(Clone, Debug)]
pub struct Bundle {
    me: RobotId,
    /// L_t.
    most: usize,
    /// b, in the order of choice.
    held: SmallVec<[Held; 4]>,
    /// p, in the order of work: places in [`Beliefs::tasks`].
    path: SmallVec<[usize; 4]>,
    /// Of each own task, as it was when the robot last chose.
    offers: Vec<Option<Offer>>,
    /// Whether a teammate's claim has taken the first of the path.
    is_outbid: bool,
}

/// A task that could be added.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    held: Held,
    priority: i32,
    /// So many of the bundle stay before it.
    after: usize,
    /// Where in the path.
    at: usize,
}

/// The part of a bundle that a task of some priority is added to.
#[derive(Clone, Debug)]
struct Stem {
    priority: i32,
    count: usize,
    path: SmallVec<[usize; 4]>,
    /// `None` if the time of a task is not known.
    score: Option<f64>,
}

impl Candidate {
    fn goes_before(&self, other: &Self) -> bool {
        let key = |it: &Self| (it.priority, it.held.value);
        key(self) > key(other)
    }
}

impl Bundle {
    /// An empty one, with at most so many tasks.
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

    /// The behavior that the path begins with.
    pub fn first(&self) -> Option<BehaviorId> {
        let offer = self.offers[*self.path.first()?];
        offer.map(|offer| offer.behavior)
    }

    /// Whether the first of the path has been lost to a teammate since the last call.
    pub fn take_outbid(&mut self) -> bool {
        std::mem::take(&mut self.is_outbid)
    }

    /// HEAR: the first task that is no longer the robot's goes, and all after it.
    pub fn drop_lost(&mut self, beliefs: &mut Beliefs) {
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

    /// Gives up all but the first `count` of the bundle.
    fn keep(&mut self, count: usize, beliefs: &mut Beliefs) {
        for held in self.held.drain(count..) {
            if let Some(place) = held.place.filter(|&place| beliefs.is_mine(place)) {
                beliefs.set(place, None);
            }
        }
        let held = &self.held;
        self.path.retain(|own| held.iter().any(|it| it.own == *own));
    }

    /// REPLAN: all is given up but the unit that is `under_way`, with the bid that it is worth now.
    pub fn replan(&mut self, keeps_first: bool, worths: &Worths<'_, '_>, beliefs: &mut Beliefs) {
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

    /// BUILD: adds the task of the largest bid that wins, until there are enough or none is left.
    pub fn build(&mut self, goes_on: bool, worths: &Worths<'_, '_>, beliefs: &mut Beliefs) {
        self.weigh(worths, beliefs);
        // A unit under way stays first.
        let fixed = self.path.first().copied().filter(|_| goes_on);
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

    /// The best bid that wins. For a task of higher priority the robot bids as if it had chosen none of those of lower ones, which go if
    /// it wins: so what was chosen earlier is never less urgent, nor the bid for it smaller.
    fn best(
        &self,
        fixed: Option<usize>,
        worths: &Worths<'_, '_>,
        beliefs: &Beliefs,
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
            // Warping: a bid is never larger than those that were made before it (Johnson, Choi, How 2012).
            let earlier = self.held[..stem.count].iter();
            let same = earlier.filter(|held| priority_of(held.own) == task.priority);
            let value = same.fold(bid(gain), |least, held| least.min(held.value));
            let Some(opening) = beliefs.opening(task, value) else {
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

    /// What of the bundle has at least that priority.
    fn stem(&self, priority: i32, worths: &Worths<'_, '_>, beliefs: &Beliefs) -> Stem {
        let is_lower = |held: &Held| beliefs.tasks()[held.own].priority < priority;
        let count = self.held.iter().position(is_lower);
        let count = count.unwrap_or(self.held.len());
        let held = &self.held[..count];
        let mut path = self.path.clone();
        path.retain(|own| held.iter().any(|it| it.own == *own));
        Stem {
            priority,
            count,
            score: self.score(&path, worths, beliefs),
            path,
        }
    }

    /// Where in the path a task adds most, and how much; of equal places the first.
    fn insertion(
        &self,
        own: usize,
        fixed: Option<usize>,
        stem: &Stem,
        worths: &Worths<'_, '_>,
        beliefs: &Beliefs,
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

    /// S(p); `None` if the time of a task is not known.
    fn score(&self, path: &[usize], worths: &Worths<'_, '_>, beliefs: &Beliefs) -> Option<f64> {
        let mut after: SmallVec<[TaskId; 4]> = SmallVec::new();
        let (mut time_s, mut score) = (0.0, 0.0);
        for &own in path {
            let offer = self.offers[own]?;
            let task = beliefs.tasks()[own].task;
            if after.is_empty() {
                time_s += offer.cost_s;
                score += offer.worth;
            } else {
                time_s += worths.input.route.seconds(&after, task)?;
                score += offer.reward * libm::pow(DISCOUNT_PER_S, time_s);
            }
            after.push(task);
        }
        Some(score)
    }

    /// Of each own task the behavior of the highest utility, the first of equal ones.
    fn weigh(&mut self, worths: &Worths<'_, '_>, beliefs: &Beliefs) {
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

    /// The tasks of the bundle in the order of choice, with the robot's bids.
    #[cfg(test)]
    pub fn bids(&self, beliefs: &Beliefs) -> Vec<(TaskId, f32)> {
        let bid = |held: &Held| (beliefs.tasks()[held.own].task, held.value);
        self.held.iter().map(bid).collect()
    }

    /// The tasks in the order of work.
    #[cfg(test)]
    pub fn path(&self, beliefs: &Beliefs) -> Vec<TaskId> {
        let path = self.path.iter();
        path.map(|&own| beliefs.tasks()[own].task).collect()
    }

    /// Whether an entry is in the bundle.
    #[cfg(test)]
    pub fn holds(&self, place: usize) -> bool {
        self.held.iter().any(|held| held.place == Some(place))
    }
}

/// What tasks are worth in a step.
pub struct Worths<'a, 'i> {
    /// Of the step.
    pub input: &'a Input<'i>,
    /// What the robot is at, if that has begun in earnest; see [`crate::allocator::unit`].
    pub begun: UnderWay,
    /// What it is at.
    pub active: Option<BehaviorId>,
}

impl Worths<'_, '_> {
    fn offer(&self, choice: &Choice) -> Option<Offer> {
        Some(Offer {
            behavior: choice.behavior,
            reward: choice.reward,
            worth: self.begun.utility(choice, self.input)?,
            cost_s: choice.cost_s?,
        })
    }
}

/// A bid is finite and above 0, whatever the mission says: 0 is none.
fn bid(worth: f64) -> f32 {
    // Not a number is not above 0.
    if worth > 0.0 {
        (worth as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
    } else {
        f32::MIN_POSITIVE
    }
}
