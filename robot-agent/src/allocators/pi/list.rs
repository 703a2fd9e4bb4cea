//! The list a of a robot, in the order of execution, and the two phases that change it: the removal of lost tasks and
//! the inclusion of new ones (Zhao, Meng, Chung 2016). γ is the negative claim in [`Winners`], β the robot of the claim.

use scenario::ids::{BehaviorId, RobotId};
use smallvec::SmallVec;

use super::impact::{Costs, bid};
use crate::allocators::consensus::winners::Winners;
use crate::broken::is_broken;

/// The number of times that a robot may take a task from teammates between two rebuilds of its list. Impacts change
/// with the lists, so that two robots could otherwise take tasks from each other without end.
pub const TAKES_MAX: u8 = 3;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    /// The index in [`Winners::tasks`].
    own: usize,
    /// The index of the entry; `None` for a task without negotiation.
    place: Option<usize>,
    behavior: BehaviorId,
}

#[derive(Clone, Debug)]
pub struct TaskList {
    me: RobotId,
    /// The maximum number of tasks.
    most: usize,
    /// The list a, with higher priorities first.
    held: SmallVec<[Held; 4]>,
    /// The times that the robot has taken each task from a teammate since the last rebuild.
    takes: Vec<u8>,
    /// True if a teammate has taken the first task.
    is_outbid: bool,
}

/// A task that may be included.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    held: Held,
    at: usize,
    impact: f64,
    gain: Gain,
}

/// The order in which tasks are included: by priority, tasks without an assignee first. Of those, the paper's large
/// initial γ times the reward leaves the larger reward and then the smaller impact; of the others, γ minus the impact.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Gain {
    priority: i32,
    is_free: bool,
    gain: (f64, f64),
}

impl TaskList {
    pub fn new(me: RobotId, most: usize, beliefs: &Winners) -> Self {
        Self {
            me,
            most,
            held: SmallVec::new(),
            takes: vec![0; beliefs.tasks().len()],
            is_outbid: false,
        }
    }

    pub fn first(&self) -> Option<BehaviorId> {
        Some(self.held.first()?.behavior)
    }

    pub fn take_outbid(&mut self) -> bool {
        std::mem::take(&mut self.is_outbid)
    }

    /// Releases all tasks, except a unit under way.
    pub fn release(&mut self, keeps_first: bool, beliefs: &mut Winners) {
        self.takes.fill(0);
        let kept = usize::from(keeps_first).min(self.held.len());
        for held in self.held.drain(kept..) {
            disclaim(held, beliefs);
        }
    }

    /// Runs both phases, and updates γ of the robot's tasks if the list has changed. A unit under way stays first.
    pub fn update(&mut self, continues: bool, costs: &Costs<'_, '_>, beliefs: &mut Winners) {
        let before = self.held.clone();
        self.drop_impossible(costs, beliefs);
        if !is_broken("pi-lost-tasks-stay-listed") {
            self.remove(costs, beliefs);
        }
        let any_won_back = self.win_back(costs, beliefs);
        self.include(continues, costs, beliefs);
        if self.held != before || any_won_back {
            self.update_gamma(costs, beliefs);
        }
    }

    /// Removes the tasks that the robot cannot do now, and all of them if the list cannot be done as a whole.
    fn drop_impossible(&mut self, costs: &Costs<'_, '_>, beliefs: &mut Winners) {
        let mut kept: SmallVec<[Held; 4]> = SmallVec::new();
        for mut held in self.held.drain(..) {
            match costs.offer(held.own) {
                Some(offer) => {
                    held.behavior = offer.behavior;
                    kept.push(held);
                }
                None => disclaim(held, beliefs),
            }
        }
        self.held = kept;
        if costs.cost(&self.list()).is_none() {
            self.release(false, beliefs);
        }
    }

    /// Removes lost tasks, first the one whose impact exceeds γ most, as long as there is one that the robot cannot win
    /// back. Each removal lowers the impacts of the other tasks.
    fn remove(&mut self, costs: &Costs<'_, '_>, beliefs: &Winners) {
        loop {
            let mut worst: Option<(f64, usize)> = None;
            for at in 0..self.held.len() {
                let held = self.held[at];
                let lost = held.place.filter(|&place| !beliefs.is_mine(place));
                let Some(place) = lost else { continue };
                let impact = self.removal(at, costs, beliefs);
                if self.opening(held.own, bid(impact), beliefs).is_some() {
                    continue;
                }
                let claim = beliefs.entries()[place].claim;
                let gamma = claim.map_or(f64::INFINITY, |claim| -f64::from(claim.value));
                let excess = impact - gamma;
                if worst.is_none_or(|(most, _)| excess > most) {
                    worst = Some((excess, at));
                }
            }
            let Some((_, at)) = worst else { return };
            self.held.remove(at);
            self.is_outbid |= at == 0;
        }
    }

    /// Claims the remaining lost tasks again. Returns whether there are any.
    fn win_back(&mut self, costs: &Costs<'_, '_>, beliefs: &mut Winners) -> bool {
        let mut any = false;
        for at in 0..self.held.len() {
            let held = self.held[at];
            if held.place.is_some_and(|place| !beliefs.is_mine(place)) {
                let impact = self.removal(at, costs, beliefs);
                if let Some(opening) = self.opening(held.own, bid(impact), beliefs) {
                    self.held[at].place = opening.place;
                    self.claim(at, impact, beliefs);
                    any = true;
                }
            }
        }
        any
    }

    /// Includes the task of the largest gain, until the list is full or no task has a gain. A task of higher priority
    /// displaces those of the lowest one.
    fn include(&mut self, continues: bool, costs: &Costs<'_, '_>, beliefs: &mut Winners) {
        let fixed = self.held.first().map(|held| held.own);
        let fixed = fixed.filter(|_| continues);
        while let Some(best) = self.best(fixed, costs, beliefs) {
            self.held.insert(best.at, best.held);
            self.claim(best.at, best.impact, beliefs);
            if self.held.len() > self.most
                && let Some(displaced) = self.held.pop()
            {
                disclaim(displaced, beliefs);
            }
        }
    }

    fn best(
        &self,
        fixed: Option<usize>,
        costs: &Costs<'_, '_>,
        beliefs: &Winners,
    ) -> Option<Candidate> {
        let list = self.list();
        let mut best: Option<Candidate> = None;
        for (own, task) in beliefs.tasks().iter().enumerate() {
            let Some(offer) = costs.offer(own).filter(|_| !list.contains(&own)) else {
                continue;
            };
            let priority = task.priority;
            let end = self.end_of(priority, beliefs);
            if end >= self.most {
                continue;
            }
            let is_first_fixed = end > 0 && list.first().copied() == fixed;
            let start = self.end_of(priority.saturating_add(1), beliefs);
            let places = start.max(usize::from(is_first_fixed))..=end;
            let Some((at, impact)) = costs.inclusion(&list[..end], own, places) else {
                continue;
            };
            let Some(opening) = self.opening(own, bid(impact), beliefs) else {
                continue;
            };
            let gain = Gain {
                priority,
                is_free: opening.gamma.is_none(),
                gain: match opening.gamma {
                    None => (offer.reward, -impact),
                    Some(gamma) => (gamma - impact, 0.0),
                },
            };
            if best.is_none_or(|best| gain > best.gain) {
                let held = Held {
                    own,
                    place: opening.place,
                    behavior: offer.behavior,
                };
                best = Some(Candidate {
                    held,
                    at,
                    impact,
                    gain,
                });
            }
        }
        best
    }

    /// Returns the place of a task that a bid wins, unless the robot has taken the task too often.
    fn opening(&self, own: usize, bid: f32, beliefs: &Winners) -> Option<Opening> {
        let place = beliefs.winnable_place(&beliefs.tasks()[own], bid)?.place;
        let claim = place.and_then(|place| beliefs.entries()[place].claim);
        let may_take = claim.is_none() || self.takes[own] < TAKES_MAX;
        may_take.then_some(Opening {
            place,
            gamma: claim.map(|claim| -f64::from(claim.value)),
        })
    }

    /// Claims all tasks of the list with their current impacts.
    pub fn update_gamma(&mut self, costs: &Costs<'_, '_>, beliefs: &mut Winners) {
        for at in 0..self.held.len() {
            let impact = self.removal(at, costs, beliefs);
            self.claim(at, impact, beliefs);
        }
    }

    /// Claims the entry of the task at a place of the list.
    fn claim(&mut self, at: usize, impact: f64, beliefs: &mut Winners) {
        let Held { own, place, .. } = self.held[at];
        let Some(place) = place else { return };
        let claim = beliefs.entries()[place].claim;
        if claim.is_some_and(|claim| claim.robot != self.me) {
            self.takes[own] = self.takes[own].saturating_add(1);
        }
        beliefs.bid(place, bid(impact));
    }

    fn removal(&self, at: usize, costs: &Costs<'_, '_>, beliefs: &Winners) -> f64 {
        let list = self.list();
        let end = self.end_of(beliefs.tasks()[list[at]].priority, beliefs);
        // The whole list can be done, and so can each part of it.
        costs.removal(&list[..end], at).unwrap_or(0.0)
    }

    /// Returns the number of tasks in the list whose priority is not lower. Impacts ignore tasks of lower priority.
    fn end_of(&self, priority: i32, beliefs: &Winners) -> usize {
        let mut held = self.held.iter();
        let is_lower = |held: &Held| beliefs.tasks()[held.own].priority < priority;
        held.position(is_lower).unwrap_or(self.held.len())
    }

    fn list(&self) -> SmallVec<[usize; 8]> {
        self.held.iter().map(|held| held.own).collect()
    }

    #[cfg(test)]
    pub fn tasks(&self, beliefs: &Winners) -> Vec<usize> {
        let held = self.held.iter();
        held.map(|held| beliefs.tasks()[held.own].task.index())
            .collect()
    }

    #[cfg(test)]
    pub fn contains(&self, place: usize) -> bool {
        self.held.iter().any(|held| held.place == Some(place))
    }

    #[cfg(test)]
    pub fn is_at_limit(&self) -> bool {
        self.takes.iter().any(|&takes| takes >= TAKES_MAX)
    }
}

/// A place of a task that a bid wins, with the γ of its assignee.
#[derive(Clone, Copy, Debug)]
struct Opening {
    place: Option<usize>,
    gamma: Option<f64>,
}

/// Withdraws the robot's claim to a task.
fn disclaim(held: Held, beliefs: &mut Winners) {
    if let Some(place) = held.place.filter(|&place| beliefs.is_mine(place))
        && !is_broken("pi-left-tasks-stay-claimed")
    {
        beliefs.set(place, None);
    }
}
