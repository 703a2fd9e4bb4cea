//! The robot's knowledge about the mission, and the rules that combine observations with messages of teammates. The
//! newest fact wins. Own observations win over messages of the same time. "Empty" expires.

#[cfg(test)]
mod tests;

use glam::Vec2;
use proto::mission::items::{Fact, ItemsKnowledge, Locations, LooseItem, Withdrawal};
use scenario::ids::RobotId;
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::sweep::Sweep;
use crate::geometry::is_possible_place;
use crate::waste::data::EMPTY_EXPIRES;
use robot_agent::body::goal::{is_shorter, length};

/// The time for which a robot ignores a spill or the report site after it found no way there.
pub(super) const SET_ASIDE: SimTime = SimTime(180_000);
/// The distance below which two places count as the same place, m.
pub(super) const SAME_PLACE_M: f32 = 0.3;
/// The lifetime of a failed search, which overrides older messages about the same place.
const SEARCHED_EXPIRES: SimTime = SimTime(120_000);
/// The maximum number of remembered loose items. It limits the size of a heartbeat.
const LOOSE_LIMIT: usize = 32;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Memory {
    robot: RobotId,
    knowledge: ItemsKnowledge,
    /// True if the robot has sensed a spill at a place where the locations predict one.
    confirmed: bool,
    /// The spills for which the robot has behavior sets, in ascending order. It stores no others.
    spills: SmallVec<[OwnSpill; 4]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct OwnSpill {
    number: u32,
    /// The time at which the robot last found no way to the spill. Not broadcast, because the robot itself may be shut
    /// in.
    out_of_reach: Option<SimTime>,
    /// The number of unreachable items and views of the spill since the robot last held something.
    closed: u32,
    sweep: Option<Sweep>,
}

impl Memory {
    pub fn new(robot: RobotId, spills: &[u32], border: Option<Locations>) -> Self {
        let locations = border.map(|value| Fact {
            value,
            seen_by: robot,
            seen: SimTime::ZERO,
        });
        Self {
            robot,
            knowledge: ItemsKnowledge {
                locations,
                ..ItemsKnowledge::default()
            },
            confirmed: false,
            spills: spills
                .iter()
                .map(|&number| OwnSpill {
                    number,
                    out_of_reach: None,
                    closed: 0,
                    sweep: None,
                })
                .collect(),
        }
    }

    pub fn knowledge(&self) -> &ItemsKnowledge {
        &self.knowledge
    }

    pub fn locations(&self) -> Option<Fact<Locations>> {
        self.knowledge.locations
    }

    pub fn is_confirmed(&self) -> bool {
        self.confirmed
    }

    /// Records that the robot sensed a spill where the locations predict one.
    pub fn confirm(&mut self) {
        self.confirmed = true;
    }

    /// Records locations that the robot itself found.
    pub fn find(&mut self, locations: Locations, now: SimTime) -> Fact<Locations> {
        let fact = self.observed(locations, now);
        self.adopt(fact);
        fact
    }

    /// Withdraws the current locations after a contradicting observation. Returns the message for the teammates.
    pub fn withdraw(&mut self) -> Option<Withdrawal> {
        let fact = self.knowledge.locations.take()?;
        self.confirmed = false;
        let withdrawal = Withdrawal {
            finder: fact.seen_by,
            seen: fact.seen,
        };
        self.record(withdrawal);
        Some(withdrawal)
    }

    pub fn observe_spill(&mut self, spill: u32, empty: bool, now: SimTime) {
        let fact = self.observed(empty, now);
        self.join_empty(spill, |_| fact);
    }

    fn index_of_spill(&self, spill: u32) -> Option<usize> {
        self.spills.iter().position(|known| known.number == spill)
    }

    /// Sets a spill aside for a while after the robot found no way to it.
    pub fn set_aside(&mut self, spill: u32, now: SimTime) {
        if let Some(index) = self.index_of_spill(spill) {
            self.spills[index].out_of_reach = Some(now);
            self.spills[index].closed = 0;
        }
    }

    /// Counts an item or view that the robot could not reach or pick up.
    pub fn count_failure(&mut self, spill: u32) {
        if let Some(index) = self.index_of_spill(spill) {
            self.spills[index].closed += 1;
        }
    }

    /// Resets the count of failures, because the robot holds an item of the spill.
    pub fn reset_failures(&mut self, spill: u32) {
        if let Some(index) = self.index_of_spill(spill) {
            self.spills[index].closed = 0;
        }
    }

    /// Returns the number of failures since the robot last held an item, over all of its active periods.
    pub fn failures(&self, spill: u32) -> u32 {
        self.index_of_spill(spill)
            .map_or(0, |index| self.spills[index].closed)
    }

    pub fn is_set_aside(&self, spill: u32, now: SimTime) -> bool {
        let index = self.index_of_spill(spill);
        let since = index.and_then(|index| self.spills[index].out_of_reach);
        since.is_some_and(|since| now.since(since) < SET_ASIDE)
    }

    /// Records an observation of a place outside the spills by the robot itself.
    pub fn observe_loose(&mut self, at: Vec2, present: bool, now: SimTime) {
        let fact = self.observed(LooseItem { at, present }, now);
        self.join_loose(fact);
    }

    pub fn report(&mut self, now: SimTime) {
        self.knowledge.last_report = Some(self.observed((), now));
    }

    pub fn last_report(&self) -> SimTime {
        self.knowledge
            .last_report
            .map_or(SimTime::ZERO, |fact| fact.seen)
    }

    /// Checks whether the spill counts as empty.
    pub fn counts_as_empty(&self, spill: u32, now: SimTime) -> bool {
        let mut known = self.knowledge.empty.iter();
        known.any(|(known, fact)| {
            *known == spill && fact.value && now.since(fact.seen) < EMPTY_EXPIRES
        })
    }

    /// Starts the search of a spill's area if the spill's state has not changed and no waste is known elsewhere.
    /// Returns whether the search started.
    pub fn begin_sweep(&mut self, spill: u32, now: SimTime) -> bool {
        let begins = self.is_all_done() && !self.counts_as_empty(spill, now);
        if let Some(index) = self.index_of_spill(spill).filter(|_| begins) {
            self.spills[index].sweep = Some(Sweep::default());
        }
        begins
    }

    pub fn sweep(&mut self, spill: u32) -> Option<&mut Sweep> {
        let index = self.index_of_spill(spill)?;
        self.spills[index].sweep.as_mut()
    }

    pub fn end_sweep(&mut self, spill: u32) {
        if let Some(index) = self.index_of_spill(spill) {
            self.spills[index].sweep = None;
        }
    }

    /// Checks whether each own spill was last seen empty or is out of reach.
    fn is_all_done(&self) -> bool {
        let mut spills = self.spills.iter();
        spills.all(|known| known.out_of_reach.is_some() || self.was_empty(known.number))
    }

    /// Checks whether the spill was empty at the last observation, at any age.
    pub fn was_empty(&self, spill: u32) -> bool {
        let mut known = self.knowledge.empty.iter();
        known.any(|&(known, fact)| known == spill && fact.value)
    }

    /// Returns the places outside the spills where waste is expected.
    pub fn loose(&self) -> impl Iterator<Item = Vec2> + '_ {
        let present = self
            .knowledge
            .loose
            .iter()
            .filter(|fact| fact.value.present);
        present.map(|fact| fact.value.at)
    }

    /// Merges the knowledge of a teammate. Returns whether it contained new locations. Loose waste is accepted only at
    /// known places and at places of `concern` to this robot.
    pub fn merge(
        &mut self,
        received: &ItemsKnowledge,
        now: SimTime,
        concern: impl Fn(Vec2) -> bool,
    ) -> bool {
        for &withdrawal in &received.withdrawn {
            self.merge_withdrawal(withdrawal);
        }
        for &(spill, received) in &received.empty {
            if received.seen <= now {
                self.join_empty(spill, |mine| newer(mine, received));
            }
        }
        if let Some(received) = received.last_report.filter(|received| received.seen <= now) {
            self.knowledge.last_report = Some(newer(self.knowledge.last_report, received));
        }
        for &fact in &received.loose {
            let at = fact.value.at;
            let is_plausible = fact.seen <= now && is_possible_place(at);
            if is_plausible && (self.loose_at(at).is_some() || concern(at)) {
                self.join_loose(fact);
            }
        }
        received
            .locations
            .is_some_and(|fact| self.merge_locations(fact, now))
    }

    /// Merges locations found by a robot. Returns whether they replaced the current ones.
    pub fn merge_locations(&mut self, fact: Fact<Locations>, now: SimTime) -> bool {
        let mine_is_better = self.knowledge.locations.is_some_and(|mine| {
            mine.seen_by == self.robot || self.confirmed || mine.seen >= fact.seen
        });
        // The usual case, because each heartbeat repeats the locations.
        if mine_is_better {
            return false;
        }
        let Locations { min, max } = fact.value;
        let are_possible = is_possible_place(min) && is_possible_place(max);
        let sound = are_possible && min.cmplt(max).all() && fact.seen <= now;
        let taken_back = self
            .knowledge
            .withdrawn
            .iter()
            .any(|withdrawn| withdrawn.finder == fact.seen_by && fact.seen <= withdrawn.seen);
        if !sound || taken_back {
            return false;
        }
        self.adopt(fact);
        true
    }

    /// Merges a withdrawal. Returns whether it withdraws this robot's own locations.
    pub fn merge_withdrawal(&mut self, withdrawal: Withdrawal) -> bool {
        let known = self
            .knowledge
            .withdrawn
            .iter()
            .any(|known| known.finder == withdrawal.finder && known.seen >= withdrawal.seen);
        let concerns_mine = self
            .knowledge
            .locations
            .is_some_and(|mine| mine.seen_by == withdrawal.finder && mine.seen <= withdrawal.seen);
        if known || (concerns_mine && self.confirmed) {
            return false;
        }
        if concerns_mine {
            self.knowledge.locations = None;
        }
        self.record(withdrawal);
        withdrawal.finder == self.robot
    }

    pub fn expire(&mut self, now: SimTime) {
        self.knowledge
            .loose
            .retain(|fact| fact.value.present || now.since(fact.seen) < SEARCHED_EXPIRES);
    }

    fn adopt(&mut self, fact: Fact<Locations>) {
        self.knowledge.locations = Some(fact);
        self.confirmed = false;
        for known in &mut self.spills {
            known.sweep = None;
        }
    }

    fn record(&mut self, withdrawal: Withdrawal) {
        let withdrawn = &mut self.knowledge.withdrawn;
        match withdrawn.binary_search_by_key(&withdrawal.finder, |known| known.finder) {
            Ok(index) => withdrawn[index].seen = withdrawn[index].seen.max(withdrawal.seen),
            Err(index) => withdrawn.insert(index, withdrawal),
        }
    }

    /// Updates the fact about an own spill with the result of `join`.
    fn join_empty(&mut self, spill: u32, join: impl Fn(Option<Fact<bool>>) -> Fact<bool>) {
        if self.index_of_spill(spill).is_none() {
            return;
        }
        let empty = &mut self.knowledge.empty;
        match empty.binary_search_by_key(&spill, |&(known, _)| known) {
            Ok(index) => empty[index].1 = join(Some(empty[index].1)),
            Err(index) => empty.insert(index, (spill, join(None))),
        }
    }

    /// Returns the index of the nearest known place that counts as the same place. Places move slightly with each
    /// observation, so several may be near. A failed search must remove the searched one.
    fn loose_at(&self, at: Vec2) -> Option<usize> {
        let loose = self.knowledge.loose.iter();
        let offsets = loose.map(|known| known.value.at - at).enumerate();
        offsets
            .filter(|&(_, offset)| is_shorter(offset, SAME_PLACE_M))
            .map(|(index, offset)| (index, length(offset)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }

    fn join_loose(&mut self, fact: Fact<LooseItem>) {
        let same = self.loose_at(fact.value.at);
        let loose = &mut self.knowledge.loose;
        match same {
            Some(index) => {
                let known = &mut loose[index];
                let is_own = fact.seen_by == self.robot;
                if fact.seen > known.seen || (fact.seen == known.seen && is_own) {
                    *known = fact;
                }
            }
            None if loose.len() < LOOSE_LIMIT => loose.push(fact),
            None => {}
        }
    }

    fn observed<T>(&self, value: T, now: SimTime) -> Fact<T> {
        Fact {
            value,
            seen_by: self.robot,
            seen: now,
        }
    }
}

/// Returns the newer of two facts, or the robot's own at equal time.
fn newer<T>(mine: Option<Fact<T>>, received: Fact<T>) -> Fact<T> {
    match mine {
        Some(mine) if mine.seen >= received.seen => mine,
        _ => received,
    }
}
