//! The robot's knowledge about the mission, and the rules that combine observations with messages of teammates. The
//! newest fact wins. Own observations win over messages of the same time. "Empty" expires.

use glam::Vec2;
use proto::mission::items::{Fact, ItemsKnowledge, Locations, LooseItem, Withdrawal};
use scenario::ids::RobotId;
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::sweep::Sweep;
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
    number: u16,
    /// The time at which the robot last found no way to the spill. Not broadcast, because the robot itself may be shut
    /// in.
    out_of_reach: Option<SimTime>,
    /// The number of unreachable items and views of the spill since the robot last held something.
    closed: u32,
    sweep: Option<Sweep>,
}

impl Memory {
    pub fn new(robot: RobotId, spills: &[u16], border: Option<Locations>) -> Self {
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

    pub fn observe_spill(&mut self, spill: u16, empty: bool, now: SimTime) {
        let fact = self.observed(empty, now);
        self.join_empty(spill, |_| fact);
    }

    fn index_of_spill(&self, spill: u16) -> Option<usize> {
        self.spills.iter().position(|known| known.number == spill)
    }

    /// Sets a spill aside for a while after the robot found no way to it.
    pub fn set_aside(&mut self, spill: u16, now: SimTime) {
        if let Some(index) = self.index_of_spill(spill) {
            self.spills[index].out_of_reach = Some(now);
            self.spills[index].closed = 0;
        }
    }

    /// Counts an item or view that the robot could not reach or pick up.
    pub fn count_failure(&mut self, spill: u16) {
        if let Some(index) = self.index_of_spill(spill) {
            self.spills[index].closed += 1;
        }
    }

    /// Resets the count of failures, because the robot holds an item of the spill.
    pub fn reset_failures(&mut self, spill: u16) {
        if let Some(index) = self.index_of_spill(spill) {
            self.spills[index].closed = 0;
        }
    }

    /// Returns the number of failures since the robot last held an item, over all of its active periods.
    pub fn failures(&self, spill: u16) -> u32 {
        self.index_of_spill(spill)
            .map_or(0, |index| self.spills[index].closed)
    }

    pub fn is_set_aside(&self, spill: u16, now: SimTime) -> bool {
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
    pub fn counts_as_empty(&self, spill: u16, now: SimTime) -> bool {
        let mut known = self.knowledge.empty.iter();
        known.any(|(known, fact)| {
            *known == spill && fact.value && now.since(fact.seen) < EMPTY_EXPIRES
        })
    }

    /// Starts the search of a spill's area if the spill's state has not changed and no waste is known elsewhere.
    /// Returns whether the search started.
    pub fn begin_sweep(&mut self, spill: u16, now: SimTime) -> bool {
        let begins = self.is_all_done() && !self.counts_as_empty(spill, now);
        if let Some(index) = self.index_of_spill(spill).filter(|_| begins) {
            self.spills[index].sweep = Some(Sweep::default());
        }
        begins
    }

    pub fn sweep(&mut self, spill: u16) -> Option<&mut Sweep> {
        let index = self.index_of_spill(spill)?;
        self.spills[index].sweep.as_mut()
    }

    pub fn end_sweep(&mut self, spill: u16) {
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
    pub fn was_empty(&self, spill: u16) -> bool {
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
            if fact.seen <= now && at.is_finite() && (self.loose_at(at).is_some() || concern(at)) {
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
        let sound = min.is_finite() && max.is_finite() && min.cmplt(max).all() && fact.seen <= now;
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
    fn join_empty(&mut self, spill: u16, join: impl Fn(Option<Fact<bool>>) -> Fact<bool>) {
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

#[cfg(test)]
mod tests {
    use super::*;

    const ME: RobotId = RobotId(0);
    const OTHER: RobotId = RobotId(1);

    fn at(seconds: u64) -> SimTime {
        SimTime(seconds * 1000)
    }

    fn locations(width: f32) -> Locations {
        Locations {
            min: Vec2::ZERO,
            max: Vec2::new(width, 9.0),
        }
    }

    fn found_by(robot: RobotId, width: f32, seen: SimTime) -> Fact<Locations> {
        Fact {
            value: locations(width),
            seen_by: robot,
            seen,
        }
    }

    fn memory() -> Memory {
        Memory::new(ME, &[0, 1], None)
    }

    fn received_empty(value: bool, seen: SimTime) -> ItemsKnowledge {
        let fact = Fact {
            value,
            seen_by: OTHER,
            seen,
        };
        ItemsKnowledge {
            empty: vec![(0, fact)],
            ..ItemsKnowledge::default()
        }
    }

    fn received_loose(at: Vec2, present: bool, seen: SimTime) -> ItemsKnowledge {
        let fact = Fact {
            value: LooseItem { at, present },
            seen_by: OTHER,
            seen,
        };
        ItemsKnowledge {
            loose: vec![fact],
            ..ItemsKnowledge::default()
        }
    }

    #[test]
    fn the_newer_of_two_facts_wins() {
        let mut memory = memory();
        memory.observe_spill(0, false, at(10));
        memory.merge(&received_empty(true, at(9)), at(11), |_| true);
        assert!(!memory.counts_as_empty(0, at(11)));
        memory.merge(&received_empty(true, at(11)), at(11), |_| true);
        assert!(memory.counts_as_empty(0, at(11)));
        assert!(!memory.counts_as_empty(1, at(11)));
    }

    #[test]
    fn an_own_observation_wins_at_equal_time() {
        let mut memory = memory();
        memory.observe_spill(0, false, at(10));
        memory.merge(&received_empty(true, at(10)), at(11), |_| true);
        assert!(!memory.counts_as_empty(0, at(11)));
    }

    #[test]
    fn facts_from_the_future_are_ignored() {
        let mut memory = memory();
        memory.merge(&received_empty(true, at(12)), at(11), |_| true);
        assert!(!memory.counts_as_empty(0, at(12)));
        assert!(!memory.merge_locations(found_by(OTHER, 12.0, at(12)), at(11)));
        memory.merge(&received_loose(Vec2::ONE, true, at(12)), at(11), |_| true);
        assert_eq!(memory.loose().count(), 0);
    }

    #[test]
    fn empty_expires() {
        let mut memory = memory();
        memory.observe_spill(0, true, at(10));
        assert!(memory.counts_as_empty(0, at(10)));
        assert!(!memory.counts_as_empty(0, at(10) + EMPTY_EXPIRES));
    }

    #[test]
    fn a_search_begins_after_all_spills_were_found_empty_again() {
        let mut memory = memory();
        let later = at(10) + EMPTY_EXPIRES;
        memory.observe_spill(0, true, at(10));
        // The other spill is first unknown, then known to contain waste.
        assert!(!memory.begin_sweep(0, later));
        memory.observe_spill(1, false, at(10));
        assert!(!memory.begin_sweep(0, later));
        memory.observe_spill(1, true, at(11));
        assert!(!memory.begin_sweep(0, at(12)));
        assert!(memory.begin_sweep(0, later) && memory.sweep(1).is_none());
        // The search continues until it is ended, independent of new findings.
        memory.sweep(0).unwrap().skip_cell();
        memory.observe_spill(0, false, later);
        assert_ne!(memory.sweep(0), Some(&mut Sweep::default()));
        memory.end_sweep(0);
        assert_eq!(memory.sweep(0), None);
    }

    #[test]
    fn spills_out_of_reach_do_not_prevent_a_search() {
        let mut memory = memory();
        let later = at(10) + EMPTY_EXPIRES;
        memory.observe_spill(0, true, at(10));
        // The failures may occur in several active periods.
        memory.count_failure(1);
        assert_eq!(memory.failures(1), 1);
        memory.set_aside(1, at(100));
        assert_eq!(memory.failures(1), 0);
        assert!(memory.begin_sweep(0, later) && memory.begin_sweep(1, later));
    }

    #[test]
    fn a_spill_out_of_reach_is_set_aside_without_a_message() {
        let mut memory = memory();
        let known = memory.knowledge().clone();
        memory.set_aside(1, at(10));
        assert!(memory.is_set_aside(1, at(10)) && !memory.is_set_aside(0, at(10)));
        assert!(!memory.is_set_aside(1, at(10) + SET_ASIDE));
        assert_eq!(memory.knowledge(), &known);
    }

    #[test]
    fn invalid_locations_are_rejected() {
        for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
            assert!(
                !memory().merge_locations(found_by(OTHER, bad, at(1)), at(2)),
                "{bad}"
            );
        }
    }

    #[test]
    fn newer_locations_replace_received_but_not_own_or_confirmed_ones() {
        let old = found_by(OTHER, 11.0, at(1));
        let new = found_by(RobotId(2), 12.0, at(2));
        let mut received = memory();
        assert!(received.merge_locations(old, at(3)));
        assert!(received.merge_locations(new, at(3)));
        assert!(!received.merge_locations(old, at(3)));

        let mut confirmed = memory();
        confirmed.merge_locations(old, at(3));
        confirmed.confirm();
        assert!(!confirmed.merge_locations(new, at(3)));

        let mut finder = memory();
        finder.find(locations(12.0), at(1));
        assert!(!finder.merge_locations(new, at(3)));
    }

    #[test]
    fn a_withdrawal_removes_only_its_update_and_older_ones() {
        let mut memory = memory();
        memory.merge_locations(found_by(OTHER, 12.0, at(5)), at(5));
        let withdrawal = Withdrawal {
            finder: OTHER,
            seen: at(5),
        };
        assert!(!memory.merge_withdrawal(withdrawal));
        assert_eq!(memory.locations(), None);
        assert!(!memory.merge_locations(found_by(OTHER, 12.0, at(4)), at(6)));
        assert!(!memory.merge_locations(found_by(OTHER, 12.0, at(5)), at(6)));
        assert!(memory.merge_locations(found_by(OTHER, 12.0, at(6)), at(6)));
        // A late duplicate does not affect the newer locations.
        memory.merge_withdrawal(withdrawal);
        assert!(memory.locations().is_some());
        // Updates of other finders stay valid.
        assert_eq!(memory.knowledge().withdrawn, vec![withdrawal]);
    }

    #[test]
    fn a_robot_that_has_sensed_the_spill_ignores_a_withdrawal() {
        let mut memory = memory();
        memory.merge_locations(found_by(OTHER, 12.0, at(5)), at(5));
        memory.confirm();
        memory.merge_withdrawal(Withdrawal {
            finder: OTHER,
            seen: at(5),
        });
        assert!(memory.locations().is_some());
        assert!(memory.knowledge().withdrawn.is_empty());
    }

    #[test]
    fn the_finder_detects_the_withdrawal_of_its_update() {
        let mut memory = memory();
        memory.find(locations(12.0), at(5));
        let withdrawal = Withdrawal {
            finder: ME,
            seen: at(5),
        };
        assert!(memory.merge_withdrawal(withdrawal));
        assert!(!memory.merge_withdrawal(withdrawal));
    }

    #[test]
    fn an_own_withdrawal_is_returned_for_broadcast() {
        let mut memory = memory();
        assert_eq!(memory.withdraw(), None);
        memory.merge_locations(found_by(OTHER, 12.0, at(5)), at(5));
        memory.confirm();
        let withdrawal = memory.withdraw();
        assert_eq!(
            withdrawal,
            Some(Withdrawal {
                finder: OTHER,
                seen: at(5)
            })
        );
        assert_eq!(memory.locations(), None);
        assert!(!memory.is_confirmed());
    }

    #[test]
    fn near_places_are_merged_and_searched_places_are_removed() {
        let mut memory = memory();
        memory.observe_loose(Vec2::ONE, true, at(1));
        memory.merge(
            &received_loose(Vec2::new(1.1, 1.0), true, at(2)),
            at(2),
            |_| true,
        );
        assert_eq!(memory.loose().count(), 1);
        memory.observe_loose(Vec2::new(1.1, 1.0), false, at(3));
        assert_eq!(memory.loose().count(), 0);
        // An older message does not restore the place while the search is remembered.
        memory.merge(
            &received_loose(Vec2::new(1.1, 1.0), true, at(2)),
            at(4),
            |_| true,
        );
        assert_eq!(memory.loose().count(), 0);
        memory.expire(at(3) + SEARCHED_EXPIRES);
        assert!(memory.knowledge().loose.is_empty());
    }

    #[test]
    fn a_failed_search_removes_the_searched_place() {
        let mut memory = memory();
        let second = Vec2::new(0.35, 0.0);
        memory.observe_loose(Vec2::ZERO, true, at(1));
        memory.observe_loose(second, true, at(1));
        // A new observation of the first place, nearer to the second.
        memory.observe_loose(Vec2::new(0.15, 0.0), true, at(2));
        assert_eq!(memory.loose().count(), 2);
        memory.observe_loose(second, false, at(3));
        assert_eq!(memory.loose().collect::<Vec<_>>(), [Vec2::new(0.15, 0.0)]);
    }

    #[test]
    fn loose_places_are_limited() {
        let mut memory = memory();
        for index in 0..100 {
            memory.observe_loose(Vec2::new(index as f32, 0.0), true, at(1));
        }
        assert_eq!(memory.loose().count(), LOOSE_LIMIT);
    }
}
