//! What a robot knows about the mission, and how it joins what it sees and what it is told (DESIGN §7): the newest wins,
//! own sight beats hearsay, "empty" expires.

use alliance_proto::ids::RobotId;
use alliance_proto::mission::items::{Fact, Knowledge, Locations, LooseItem, Withdrawal};
use alliance_proto::time::SimTime;
use glam::Vec2;
use smallvec::SmallVec;

use super::sweep::Sweep;
use crate::waste::data::EMPTY_EXPIRES;
use robot_agent::body::goal::{is_shorter, length};

/// How long a robot leaves a spill, or the report site, alone to which it has found no way.
pub(super) const SET_ASIDE: SimTime = SimTime(180_000);
/// Places nearer to each other than this are one, m.
pub(super) const SAME_PLACE_M: f32 = 0.3;
/// How long a place that was searched in vain is remembered, against older hearsay.
const SEARCHED_EXPIRES: SimTime = SimTime(120_000);
/// More loose items than this are not remembered: a heartbeat has to stay small.
const LOOSE_LIMIT: usize = 32;

/// A robot's knowledge.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Memory {
    robot: RobotId,
    knowledge: Knowledge,
    /// Whether the robot has itself sensed a spill where the locations say that one is.
    confirmed: bool,
    /// The spills that the robot has behavior sets for, in ascending order: of others it remembers nothing.
    spills: SmallVec<[OwnSpill; 4]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct OwnSpill {
    number: u16,
    /// When the robot last found no way to it. It tells nobody: it may be shut in itself.
    out_of_reach: Option<SimTime>,
    /// How many of its items and views it has found no way to since it last held something.
    closed: u32,
    /// The search of its part of the room, while it goes on.
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
            knowledge: Knowledge {
                locations,
                ..Knowledge::default()
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

    pub fn knowledge(&self) -> &Knowledge {
        &self.knowledge
    }

    /// The border's extremes, where known.
    pub fn locations(&self) -> Option<Fact<Locations>> {
        self.knowledge.locations
    }

    /// Whether the robot has itself sensed a spill where the locations say that one is.
    pub fn is_confirmed(&self) -> bool {
        self.confirmed
    }

    /// Own sight of a spill where the locations say that one is.
    pub fn confirm(&mut self) {
        self.confirmed = true;
    }

    /// Own finding of the locations.
    pub fn find(&mut self, locations: Locations, now: SimTime) -> Fact<Locations> {
        let fact = self.own(locations, now);
        self.adopt(fact);
        fact
    }

    /// Takes the present locations back after own sight of the contrary; returns what to tell the others.
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

    /// A spill, as seen by the robot itself.
    pub fn see_spill(&mut self, spill: u16, empty: bool, now: SimTime) {
        let fact = self.own(empty, now);
        self.join_empty(spill, |_| fact);
    }

    fn own_spill(&self, spill: u16) -> Option<usize> {
        // They are few.
        self.spills.iter().position(|own| own.number == spill)
    }

    /// The robot has found no way to a spill, and leaves it alone for a while.
    pub fn set_aside(&mut self, spill: u16, now: SimTime) {
        if let Some(own) = self.own_spill(spill) {
            self.spills[own].out_of_reach = Some(now);
            self.spills[own].closed = 0;
        }
    }

    /// The robot has found no way to something of a spill, or could not take it up.
    pub fn close(&mut self, spill: u16) {
        if let Some(own) = self.own_spill(spill) {
            self.spills[own].closed += 1;
        }
    }

    /// The robot holds something of the spill.
    pub fn reopen(&mut self, spill: u16) {
        if let Some(own) = self.own_spill(spill) {
            self.spills[own].closed = 0;
        }
    }

    /// How often it has found no way since it last held something, in how many stints it may be.
    pub fn closed(&self, spill: u16) -> u32 {
        self.own_spill(spill)
            .map_or(0, |own| self.spills[own].closed)
    }

    /// Whether the robot leaves the spill alone.
    pub fn is_set_aside(&self, spill: u16, now: SimTime) -> bool {
        let own = self.own_spill(spill);
        let since = own.and_then(|own| self.spills[own].out_of_reach);
        since.is_some_and(|since| now.since(since) < SET_ASIDE)
    }

    /// A place outside the spills, as seen by the robot itself.
    pub fn see_loose(&mut self, at: Vec2, present: bool, now: SimTime) {
        let fact = self.own(LooseItem { at, present }, now);
        self.join_loose(fact);
    }

    /// The robot's own progress report.
    pub fn report(&mut self, now: SimTime) {
        self.knowledge.last_report = Some(self.own((), now));
    }

    /// When the mission was last reported, as far as known.
    pub fn last_report(&self) -> SimTime {
        self.knowledge
            .last_report
            .map_or(SimTime::ZERO, |fact| fact.seen)
    }

    /// Whether the spill is taken to be empty.
    pub fn believes_empty(&self, spill: u16, now: SimTime) -> bool {
        let mut known = self.knowledge.empty.iter();
        known.any(|(known, fact)| {
            *known == spill && fact.value && now.since(fact.seen) < EMPTY_EXPIRES
        })
    }

    /// Begins the search of a spill's part of the room, if the spill, seen empty or left alone before, has proved to be no
    /// different, and nothing is known to be left at the others; whether it has.
    pub fn begin_sweep(&mut self, spill: u16, now: SimTime) -> bool {
        let begins = self.is_all_done() && !self.believes_empty(spill, now);
        if let Some(own) = self.own_spill(spill).filter(|_| begins) {
            self.spills[own].sweep = Some(Sweep::default());
        }
        begins
    }

    /// The search of a spill's part of the room, once it has begun.
    pub fn sweep(&mut self, spill: u16) -> Option<&mut Sweep> {
        let own = self.own_spill(spill)?;
        self.spills[own].sweep.as_mut()
    }

    /// The search of a spill's part of the room is over.
    pub fn end_sweep(&mut self, spill: u16) {
        if let Some(own) = self.own_spill(spill) {
            self.spills[own].sweep = None;
        }
    }

    /// Whether each of its spills was empty when it was last seen, or has proved to be out of reach.
    fn is_all_done(&self) -> bool {
        let mut spills = self.spills.iter();
        spills.all(|own| own.out_of_reach.is_some() || self.was_empty(own.number))
    }

    /// Whether the spill was empty when it was last seen, however long ago.
    pub fn was_empty(&self, spill: u16) -> bool {
        let mut known = self.knowledge.empty.iter();
        known.any(|&(known, fact)| known == spill && fact.value)
    }

    /// Places outside the spills where something is taken to lie.
    pub fn loose(&self) -> impl Iterator<Item = Vec2> + '_ {
        let present = self
            .knowledge
            .loose
            .iter()
            .filter(|fact| fact.value.present);
        present.map(|fact| fact.value.at)
    }

    /// Joins what a teammate knows at `now`; true if new locations were learned from it. Of loose waste it takes what is
    /// its own `concern`, and news of what it knew to lie there.
    pub fn hear(&mut self, told: &Knowledge, now: SimTime, concern: impl Fn(Vec2) -> bool) -> bool {
        for &withdrawal in &told.withdrawn {
            self.hear_withdrawal(withdrawal);
        }
        for &(spill, told) in &told.empty {
            if told.seen <= now {
                self.join_empty(spill, |mine| newer(mine, told));
            }
        }
        if let Some(told) = told.last_report.filter(|told| told.seen <= now) {
            self.knowledge.last_report = Some(newer(self.knowledge.last_report, told));
        }
        for &fact in &told.loose {
            let at = fact.value.at;
            if fact.seen <= now && at.is_finite() && (self.loose_at(at).is_some() || concern(at)) {
                self.join_loose(fact);
            }
        }
        told.locations
            .is_some_and(|fact| self.hear_locations(fact, now))
    }

    /// Locations that somebody found; true if they were new and taken over.
    pub fn hear_locations(&mut self, fact: Fact<Locations>, now: SimTime) -> bool {
        let mine_is_better = self.knowledge.locations.is_some_and(|mine| {
            mine.seen_by == self.robot || self.confirmed || mine.seen >= fact.seen
        });
        // As mostly: each heartbeat tells them.
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

    /// A withdrawal that somebody broadcast; true if it takes this robot's own finding back.
    pub fn hear_withdrawal(&mut self, withdrawal: Withdrawal) -> bool {
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

    /// Forgets what is too old to matter.
    pub fn expire(&mut self, now: SimTime) {
        self.knowledge
            .loose
            .retain(|fact| fact.value.present || now.since(fact.seen) < SEARCHED_EXPIRES);
    }

    fn adopt(&mut self, fact: Fact<Locations>) {
        self.knowledge.locations = Some(fact);
        self.confirmed = false;
        for own in &mut self.spills {
            own.sweep = None;
        }
    }

    fn record(&mut self, withdrawal: Withdrawal) {
        let withdrawn = &mut self.knowledge.withdrawn;
        match withdrawn.binary_search_by_key(&withdrawal.finder, |known| known.finder) {
            Ok(index) => withdrawn[index].seen = withdrawn[index].seen.max(withdrawal.seen),
            Err(index) => withdrawn.insert(index, withdrawal),
        }
    }

    /// What is known of one of its own spills is what `join` makes of it.
    fn join_empty(&mut self, spill: u16, join: impl Fn(Option<Fact<bool>>) -> Fact<bool>) {
        if self.own_spill(spill).is_none() {
            return;
        }
        let empty = &mut self.knowledge.empty;
        match empty.binary_search_by_key(&spill, |&(known, _)| known) {
            Ok(index) => empty[index].1 = join(Some(empty[index].1)),
            Err(index) => empty.insert(index, (spill, join(None))),
        }
    }

    /// The place among those known that is that one. The nearest: places move a little as they are seen anew, so that two may be
    /// as near as one, and a search in vain has to take back the one that was searched.
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
                let own = fact.seen_by == self.robot;
                if fact.seen > known.seen || (fact.seen == known.seen && own) {
                    *known = fact;
                }
            }
            None if loose.len() < LOOSE_LIMIT => loose.push(fact),
            None => {}
        }
    }

    fn own<T>(&self, value: T, now: SimTime) -> Fact<T> {
        Fact {
            value,
            seen_by: self.robot,
            seen: now,
        }
    }
}

/// The newer of two facts; of the same time, the one's own.
fn newer<T>(mine: Option<Fact<T>>, told: Fact<T>) -> Fact<T> {
    match mine {
        Some(mine) if mine.seen >= told.seen => mine,
        _ => told,
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

    fn told_empty(value: bool, seen: SimTime) -> Knowledge {
        let fact = Fact {
            value,
            seen_by: OTHER,
            seen,
        };
        Knowledge {
            empty: vec![(0, fact)],
            ..Knowledge::default()
        }
    }

    fn told_loose(at: Vec2, present: bool, seen: SimTime) -> Knowledge {
        let fact = Fact {
            value: LooseItem { at, present },
            seen_by: OTHER,
            seen,
        };
        Knowledge {
            loose: vec![fact],
            ..Knowledge::default()
        }
    }

    #[test]
    fn of_two_facts_the_newer_wins() {
        let mut memory = memory();
        memory.see_spill(0, false, at(10));
        memory.hear(&told_empty(true, at(9)), at(11), |_| true);
        assert!(!memory.believes_empty(0, at(11)));
        memory.hear(&told_empty(true, at(11)), at(11), |_| true);
        assert!(memory.believes_empty(0, at(11)));
        assert!(!memory.believes_empty(1, at(11)));
    }

    #[test]
    fn of_facts_of_the_same_time_own_sight_wins() {
        let mut memory = memory();
        memory.see_spill(0, false, at(10));
        memory.hear(&told_empty(true, at(10)), at(11), |_| true);
        assert!(!memory.believes_empty(0, at(11)));
    }

    #[test]
    fn what_is_said_to_be_seen_in_the_future_is_ignored() {
        let mut memory = memory();
        memory.hear(&told_empty(true, at(12)), at(11), |_| true);
        assert!(!memory.believes_empty(0, at(12)));
        assert!(!memory.hear_locations(found_by(OTHER, 12.0, at(12)), at(11)));
        memory.hear(&told_loose(Vec2::ONE, true, at(12)), at(11), |_| true);
        assert_eq!(memory.loose().count(), 0);
    }

    #[test]
    fn empty_expires() {
        let mut memory = memory();
        memory.see_spill(0, true, at(10));
        assert!(memory.believes_empty(0, at(10)));
        assert!(!memory.believes_empty(0, at(10) + EMPTY_EXPIRES));
    }

    #[test]
    fn a_search_begins_when_all_has_been_found_empty_again() {
        let mut memory = memory();
        let later = at(10) + EMPTY_EXPIRES;
        memory.see_spill(0, true, at(10));
        // Nothing is known of the other one, and then that something is there.
        assert!(!memory.begin_sweep(0, later));
        memory.see_spill(1, false, at(10));
        assert!(!memory.begin_sweep(0, later));
        memory.see_spill(1, true, at(11));
        assert!(!memory.begin_sweep(0, at(12)));
        assert!(memory.begin_sweep(0, later) && memory.sweep(1).is_none());
        // It goes on, whatever is found, until it is over.
        memory.sweep(0).unwrap().pass();
        memory.see_spill(0, false, later);
        assert_ne!(memory.sweep(0), Some(&mut Sweep::default()));
        memory.end_sweep(0);
        assert_eq!(memory.sweep(0), None);
    }

    #[test]
    fn spills_that_are_out_of_reach_do_not_keep_it_from_a_search() {
        let mut memory = memory();
        let later = at(10) + EMPTY_EXPIRES;
        memory.see_spill(0, true, at(10));
        // In however many stints that shows.
        memory.close(1);
        assert_eq!(memory.closed(1), 1);
        memory.set_aside(1, at(100));
        assert_eq!(memory.closed(1), 0);
        assert!(memory.begin_sweep(0, later) && memory.begin_sweep(1, later));
    }

    #[test]
    fn what_is_out_of_reach_is_left_alone_for_a_while_and_no_one_is_told() {
        let mut memory = memory();
        let known = memory.knowledge().clone();
        memory.set_aside(1, at(10));
        assert!(memory.is_set_aside(1, at(10)) && !memory.is_set_aside(0, at(10)));
        assert!(!memory.is_set_aside(1, at(10) + SET_ASIDE));
        assert_eq!(memory.knowledge(), &known);
    }

    #[test]
    fn nonsense_is_no_location() {
        for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
            assert!(
                !memory().hear_locations(found_by(OTHER, bad, at(1)), at(2)),
                "{bad}"
            );
        }
    }

    #[test]
    fn newer_locations_replace_hearsay_but_not_own_finding_or_sight() {
        let old = found_by(OTHER, 11.0, at(1));
        let new = found_by(RobotId(2), 12.0, at(2));
        let mut hearsay = memory();
        assert!(hearsay.hear_locations(old, at(3)));
        assert!(hearsay.hear_locations(new, at(3)));
        assert!(!hearsay.hear_locations(old, at(3)));

        let mut confirmed = memory();
        confirmed.hear_locations(old, at(3));
        confirmed.confirm();
        assert!(!confirmed.hear_locations(new, at(3)));

        let mut own = memory();
        own.find(locations(12.0), at(1));
        assert!(!own.hear_locations(new, at(3)));
    }

    #[test]
    fn a_withdrawal_takes_back_that_update_and_older_ones_only() {
        let mut memory = memory();
        memory.hear_locations(found_by(OTHER, 12.0, at(5)), at(5));
        let withdrawal = Withdrawal {
            finder: OTHER,
            seen: at(5),
        };
        assert!(!memory.hear_withdrawal(withdrawal));
        assert_eq!(memory.locations(), None);
        assert!(!memory.hear_locations(found_by(OTHER, 12.0, at(4)), at(6)));
        assert!(!memory.hear_locations(found_by(OTHER, 12.0, at(5)), at(6)));
        assert!(memory.hear_locations(found_by(OTHER, 12.0, at(6)), at(6)));
        // Heard again, late, it does no harm to the newer one.
        memory.hear_withdrawal(withdrawal);
        assert!(memory.locations().is_some());
        // Another finder's update is another matter.
        assert_eq!(memory.knowledge().withdrawn, vec![withdrawal]);
    }

    #[test]
    fn who_has_sensed_the_spill_ignores_a_withdrawal() {
        let mut memory = memory();
        memory.hear_locations(found_by(OTHER, 12.0, at(5)), at(5));
        memory.confirm();
        memory.hear_withdrawal(Withdrawal {
            finder: OTHER,
            seen: at(5),
        });
        assert!(memory.locations().is_some());
        assert!(memory.knowledge().withdrawn.is_empty());
    }

    #[test]
    fn the_finder_learns_that_its_update_was_withdrawn() {
        let mut memory = memory();
        memory.find(locations(12.0), at(5));
        let withdrawal = Withdrawal {
            finder: ME,
            seen: at(5),
        };
        assert!(memory.hear_withdrawal(withdrawal));
        assert!(!memory.hear_withdrawal(withdrawal));
    }

    #[test]
    fn own_withdrawal_is_what_the_others_hear() {
        let mut memory = memory();
        assert_eq!(memory.withdraw(), None);
        memory.hear_locations(found_by(OTHER, 12.0, at(5)), at(5));
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
    fn places_that_are_near_are_one_and_searched_ones_are_gone() {
        let mut memory = memory();
        memory.see_loose(Vec2::ONE, true, at(1));
        memory.hear(&told_loose(Vec2::new(1.1, 1.0), true, at(2)), at(2), |_| {
            true
        });
        assert_eq!(memory.loose().count(), 1);
        memory.see_loose(Vec2::new(1.1, 1.0), false, at(3));
        assert_eq!(memory.loose().count(), 0);
        // Older hearsay does not bring it back, as long as the search is remembered.
        memory.hear(&told_loose(Vec2::new(1.1, 1.0), true, at(2)), at(4), |_| {
            true
        });
        assert_eq!(memory.loose().count(), 0);
        memory.expire(at(3) + SEARCHED_EXPIRES);
        assert!(memory.knowledge().loose.is_empty());
    }

    #[test]
    fn a_search_in_vain_takes_back_the_place_that_was_searched() {
        let mut memory = memory();
        let second = Vec2::new(0.35, 0.0);
        memory.see_loose(Vec2::ZERO, true, at(1));
        memory.see_loose(second, true, at(1));
        // The first one, seen again nearer to the second.
        memory.see_loose(Vec2::new(0.15, 0.0), true, at(2));
        assert_eq!(memory.loose().count(), 2);
        memory.see_loose(second, false, at(3));
        assert_eq!(memory.loose().collect::<Vec<_>>(), [Vec2::new(0.15, 0.0)]);
    }

    #[test]
    fn loose_places_are_limited() {
        let mut memory = memory();
        for index in 0..100 {
            memory.see_loose(Vec2::new(index as f32, 0.0), true, at(1));
        }
        assert_eq!(memory.loose().count(), LOOSE_LIMIT);
    }
}
