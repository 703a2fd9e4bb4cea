//! The cost of a list and the impacts of its tasks (Zhao, Meng, Chung 2016).
//!
//! The cost of a list is Σ r·(t − o), with r the reward of a task, t the time at which its unit is done along the list,
//! and o the time at which its window opens, 0 for an open one. With equal rewards it is the sum of times of the paper.

use scenario::ids::{BehaviorId, TaskId};
use smallvec::SmallVec;

use crate::allocator::unit::WorkUnit;
use crate::allocator::{Choice, Input};
use crate::allocators::consensus::winners::OwnTask;

/// The best behavior for a task, with its reward and cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offer {
    pub behavior: BehaviorId,
    pub reward: f64,
    /// The duration of the unit as the next one, s.
    cost_s: f64,
    /// The time until the task's window opens, s.
    opens_in_s: f64,
    /// The cost of the unit as the next one, if it is under way: 0, or −r for a laden robot.
    committed: Option<f64>,
}

/// The costs of one robot in one step. Lists contain indices of the robot's tasks.
pub struct Costs<'a, 'i> {
    input: &'a Input<'i>,
    tasks: &'a [OwnTask],
    offers: Vec<Option<Offer>>,
}

impl<'a, 'i> Costs<'a, 'i> {
    /// Stores the behavior of least cost for each task; the first of equal ones.
    pub fn new(input: &'a Input<'i>, tasks: &'a [OwnTask], unit: &WorkUnit) -> Self {
        let mut offers: Vec<Option<Offer>> = vec![None; tasks.len()];
        for choice in input.choices {
            let Ok(own) = tasks.binary_search_by_key(&choice.task, |own| own.task) else {
                continue;
            };
            let place = &mut offers[own];
            if let Some(offer) = offer(choice, unit, input)
                && place.is_none_or(|other| offer.alone() < other.alone())
            {
                *place = Some(offer);
            }
        }
        Self {
            input,
            tasks,
            offers,
        }
    }

    /// Returns the offer for a task; `None` if the robot cannot perform it now.
    pub fn offer(&self, own: usize) -> Option<&Offer> {
        self.offers[own].as_ref()
    }

    /// Computes the cost of a list; `None` if a task cannot be done at its place.
    pub fn cost(&self, list: &[usize]) -> Option<f64> {
        let mut after: SmallVec<[TaskId; 8]> = SmallVec::new();
        let (mut time_s, mut cost) = (0.0, 0.0);
        for &own in list {
            let offer = self.offer(own)?;
            let task = self.tasks[own].task;
            if after.is_empty() {
                time_s += offer.cost_s;
                cost += offer.alone();
            } else {
                time_s += (self.input.seconds)(&after, task)?;
                cost += offer.reward * (time_s - offer.opens_in_s).max(0.0);
            }
            after.push(task);
        }
        Some(cost)
    }

    /// Computes the removal impact of the task at a place of the list: the decrease of the list's cost when the task is
    /// removed, and the cost alone for a unit under way.
    pub fn removal(&self, list: &[usize], at: usize) -> Option<f64> {
        let committed = self.offer(list[at])?.committed.filter(|_| at == 0);
        if committed.is_some() {
            return committed;
        }
        let mut without: SmallVec<[usize; 8]> = list.into();
        without.remove(at);
        let impact = self.cost(list)? - self.cost(&without).unwrap_or(0.0);
        Some(impact.max(LEAST))
    }

    /// Computes the inclusion impact of a task: the least increase of the list's cost over the places in a range; the
    /// first of equal ones. Returns the place and the impact.
    pub fn inclusion(
        &self,
        list: &[usize],
        own: usize,
        places: std::ops::RangeInclusive<usize>,
    ) -> Option<(usize, f64)> {
        let before = self.cost(list)?;
        let mut best: Option<(usize, f64)> = None;
        for at in places {
            let mut with: SmallVec<[usize; 8]> = list.into();
            with.insert(at, own);
            let committed = self.offer(own)?.committed.filter(|_| at == 0);
            let impact = committed.or_else(|| Some((self.cost(&with)? - before).max(LEAST)));
            if let Some(impact) = impact
                && best.is_none_or(|(_, least)| impact < least)
            {
                best = Some((at, impact));
            }
        }
        best
    }
}

/// The least impact of a task that is not under way. A unit under way is therefore never taken by a robot that has not
/// begun it.
const LEAST: f64 = f32::MIN_POSITIVE as f64;

impl Offer {
    /// Returns the cost of the task as the only one of a list.
    fn alone(&self) -> f64 {
        let late_s = (self.cost_s - self.opens_in_s).max(0.0);
        self.committed.unwrap_or(self.reward * late_s)
    }
}

fn offer(choice: &Choice, unit: &WorkUnit, input: &Input<'_>) -> Option<Offer> {
    if !choice.applicable {
        return None;
    }
    let bonus = unit.committed().bonus(choice.behavior, input);
    Some(Offer {
        behavior: choice.behavior,
        reward: choice.reward,
        cost_s: choice.cost_s?,
        opens_in_s: choice.opens_in_s,
        committed: bonus.map(|bonus| choice.reward * (1.0 - bonus)),
    })
}

/// Converts an impact to a finite bid −γ; the larger bid wins.
pub fn bid(impact: f64) -> f32 {
    ((0.0 - impact) as f32).clamp(f32::MIN, f32::MAX)
}
