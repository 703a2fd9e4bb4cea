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
