//! Tests of the combination of own observations and messages.

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

/// Returns a fact that a teammate has observed after some seconds.
fn observed<T>(value: T, seconds: u64) -> Fact<T> {
    Fact {
        value,
        seen_by: OTHER,
        seen: at(seconds),
    }
}

fn found(width: f32, seconds: u64) -> Fact<Locations> {
    observed(locations(width), seconds)
}

fn memory() -> Memory {
    Memory::new(ME, &[0, 1], None)
}

/// Creates a memory with locations that a teammate found after 5 s.
fn informed() -> Memory {
    let mut memory = memory();
    assert!(memory.merge_locations(found(12.0, 5), at(5)));
    memory
}

const WITHDRAWAL: Withdrawal = Withdrawal {
    finder: OTHER,
    seen: SimTime(5_000),
};

/// Receives that the first spill is empty.
fn receive_empty(memory: &mut Memory, seconds: u64, now: SimTime) {
    let knowledge = ItemsKnowledge {
        empty: vec![(0, observed(true, seconds))],
        ..ItemsKnowledge::default()
    };
    memory.merge(&knowledge, now, |_| true);
}

fn receive_loose(memory: &mut Memory, x: f32, seconds: u64, now: SimTime) {
    let item = LooseItem {
        at: Vec2::new(x, 1.0),
        present: true,
    };
    let knowledge = ItemsKnowledge {
        loose: vec![observed(item, seconds)],
        ..ItemsKnowledge::default()
    };
    memory.merge(&knowledge, now, |_| true);
}

/// Of two facts the newer one wins, and the robot's own at equal time. Facts from the future are ignored, and "empty"
/// expires.
#[test]
fn the_newer_of_two_facts_wins() {
    let mut memory = memory();
    memory.observe_spill(0, false, at(10));
    for (seconds, is_empty) in [(9, false), (10, false), (12, false), (11, true)] {
        receive_empty(&mut memory, seconds, at(11));
        let counts = [0, 1].map(|spill| memory.counts_as_empty(spill, at(11)));
        assert_eq!(counts, [is_empty, false], "from {seconds} s");
    }
    assert!(!memory.counts_as_empty(0, at(11) + EMPTY_EXPIRES));
    assert!(!memory.merge_locations(found(12.0, 12), at(11)));
    receive_loose(&mut memory, 1.0, 12, at(11));
    assert_eq!(memory.loose().count(), 0);
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

/// A spill out of reach is set aside for a while without a message, and does not prevent a search.
#[test]
fn spills_out_of_reach_are_set_aside() {
    let mut memory = memory();
    memory.observe_spill(0, true, at(10));
    // The failures may occur in several active periods.
    memory.count_failure(1);
    assert_eq!(memory.failures(1), 1);
    let known = memory.knowledge().clone();
    memory.set_aside(1, at(100));
    assert_eq!(memory.failures(1), 0);
    assert_eq!(memory.knowledge(), &known);
    assert!(memory.is_set_aside(1, at(100)) && !memory.is_set_aside(0, at(100)));
    assert!(!memory.is_set_aside(1, at(100) + SET_ASIDE));
    let later = at(10) + EMPTY_EXPIRES;
    assert!(memory.begin_sweep(0, later) && memory.begin_sweep(1, later));
}

#[test]
fn invalid_locations_are_rejected() {
    for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
        let is_merged = memory().merge_locations(found(bad, 1), at(2));
        assert!(!is_merged, "{bad}");
    }
}

#[test]
fn newer_locations_replace_received_but_not_own_or_confirmed_ones() {
    let new = Fact {
        seen_by: RobotId(2),
        ..found(12.0, 6)
    };
    let mut received = informed();
    assert!(received.merge_locations(new, at(7)));
    assert!(!received.merge_locations(found(12.0, 5), at(7)));
    let mut confirmed = informed();
    confirmed.confirm();
    assert!(!confirmed.merge_locations(new, at(7)));
    let mut finder = memory();
    finder.find(locations(12.0), at(5));
    assert!(!finder.merge_locations(new, at(7)));
}

#[test]
fn a_withdrawal_removes_only_its_update_and_older_ones() {
    let mut memory = informed();
    assert!(!memory.merge_withdrawal(WITHDRAWAL));
    assert_eq!(memory.locations(), None);
    for (seconds, is_merged) in [(4, false), (5, false), (6, true)] {
        let merged = memory.merge_locations(found(12.0, seconds), at(6));
        assert_eq!(merged, is_merged, "from {seconds} s");
    }
    // A late duplicate does not affect the newer locations.
    memory.merge_withdrawal(WITHDRAWAL);
    assert!(memory.locations().is_some());
    // Updates of other finders stay valid.
    assert_eq!(memory.knowledge().withdrawn, [WITHDRAWAL]);
    // A robot that has sensed the spill ignores a withdrawal.
    let mut confirmed = informed();
    confirmed.confirm();
    confirmed.merge_withdrawal(WITHDRAWAL);
    assert!(confirmed.locations().is_some());
    assert!(confirmed.knowledge().withdrawn.is_empty());
    // The finder detects the withdrawal of its update.
    let mut finder = self::memory();
    finder.find(locations(12.0), at(5));
    let own = Withdrawal {
        finder: ME,
        ..WITHDRAWAL
    };
    assert!(finder.merge_withdrawal(own));
    assert!(!finder.merge_withdrawal(own));
}

#[test]
fn an_own_withdrawal_is_returned_for_broadcast() {
    assert_eq!(memory().withdraw(), None);
    let mut memory = informed();
    memory.confirm();
    assert_eq!(memory.withdraw(), Some(WITHDRAWAL));
    assert_eq!((memory.locations(), memory.is_confirmed()), (None, false));
}

#[test]
fn near_places_are_merged_and_searched_places_are_removed() {
    let mut memory = memory();
    memory.observe_loose(Vec2::ONE, true, at(1));
    receive_loose(&mut memory, 1.1, 2, at(2));
    assert_eq!(memory.loose().count(), 1);
    memory.observe_loose(Vec2::new(1.1, 1.0), false, at(3));
    assert_eq!(memory.loose().count(), 0);
    // An older message does not restore the place while the search is remembered.
    receive_loose(&mut memory, 1.1, 2, at(4));
    assert_eq!(memory.loose().count(), 0);
    memory.expire(at(3) + SEARCHED_EXPIRES);
    assert!(memory.knowledge().loose.is_empty());
}

#[test]
fn a_failed_search_removes_the_searched_place() {
    let mut memory = memory();
    let [first, second] = [0.15, 0.35].map(|x| Vec2::new(x, 0.0));
    memory.observe_loose(Vec2::ZERO, true, at(1));
    memory.observe_loose(second, true, at(1));
    // A new observation of the first place, nearer to the second.
    memory.observe_loose(first, true, at(2));
    assert_eq!(memory.loose().count(), 2);
    memory.observe_loose(second, false, at(3));
    assert!(memory.loose().eq([first]));
    // The number of places is limited.
    for index in 0..100 {
        memory.observe_loose(Vec2::new(index as f32, 9.0), true, at(4));
    }
    assert_eq!(memory.knowledge().loose.len(), LOOSE_LIMIT);
}
