//! Tests of a robot's memory.

use glam::Vec2;
use proptest::prelude::*;
use proto::mission::MAX_KNOWLEDGE_BYTES;
use scenario::time::SimTime;

use super::memory::{Memory, Ranges};
use super::*;

const REACH: Ranges = Ranges {
    sight_m: 2.6,
    targets_m: 3.0,
    robots_m: 2.0,
};
const FASTEST_M_S: f32 = 0.15;

fn sighting(target: u32, x: f32, when_ms: u64) -> Sighting {
    Sighting {
        target,
        at: Vec2::new(x, 0.0),
        when: SimTime(when_ms),
    }
}

/// Seen at 2 m, and at 2.1 m a second later, the target is at 2.65 m 5.5 s after that. Beyond 3.0 m it is removed.
#[test]
fn a_target_out_of_sight_moves_straight_on() {
    let mut memory = Memory::default();
    assert!(memory.add_reading(sighting(3, 2.0, 0), FASTEST_M_S));
    memory.clear_in_sight();
    assert!(
        !memory.add_reading(sighting(3, 2.1, 1000), FASTEST_M_S),
        "it is not new"
    );
    let at = |memory: &Memory, ms| memory.tracks().next().map(|track| track.at(SimTime(ms)).x);
    assert!((at(&memory, 6500).unwrap() - 2.65).abs() < 1e-4);
    // The target is predicted out of sight, but near.
    memory.clear_in_sight();
    memory.remove_stale(Vec2::ZERO, REACH, SimTime(6500));
    assert!(memory.has_tracks());
    assert_eq!(memory.in_sight().count(), 0);
    memory.remove_stale(Vec2::ZERO, REACH, SimTime(10_500));
    assert!(!memory.has_tracks(), "at 3.05 m");
}

/// A target that should be in sight and is not is removed. Without a working device it stays.
#[test]
fn a_missing_target_is_removed() {
    for (sight_m, is_known) in [(2.6, false), (-1.0, true), (1.0, true)] {
        let mut memory = Memory::default();
        memory.add_reading(sighting(3, 1.0, 0), FASTEST_M_S);
        memory.clear_in_sight();
        memory.remove_stale(Vec2::ZERO, Ranges { sight_m, ..REACH }, SimTime(100));
        assert_eq!(memory.has_tracks(), is_known, "{sight_m}");
        memory.remove_stale(Vec2::ZERO, Ranges { sight_m, ..REACH }, SimTime(10_100));
        assert!(!memory.has_tracks(), "after ten seconds");
    }
}

/// A teammate's message counts for 2.5 s. Distant targets in it do not count.
#[test]
fn a_target_that_a_teammate_sees_is_shared_for_a_while() {
    let mut memory = Memory::default();
    memory.add_reading(sighting(1, 2.0, 1000), FASTEST_M_S);
    memory.add_message(sighting(1, 2.0, 950), FASTEST_M_S);
    memory.add_message(sighting(2, 2.9, 950), FASTEST_M_S);
    memory.add_message(sighting(4, 3.1, 950), FASTEST_M_S);
    memory.remove_stale(Vec2::ZERO, REACH, SimTime(1000));
    let shared = |memory: &Memory, ms| -> Vec<bool> {
        memory
            .tracks()
            .map(|track| track.is_shared(SimTime(ms)))
            .collect()
    };
    assert_eq!(shared(&memory, 1000), [true, true], "t4 is too far away");
    assert_eq!(shared(&memory, 3450), [true, true]);
    assert_eq!(shared(&memory, 3451), [false, false]);
    memory.add_teammate(RobotId(7), Vec2::X, SimTime(1000));
    memory.add_teammate(RobotId(8), 3.0 * Vec2::X, SimTime(1000));
    memory.remove_stale(Vec2::ZERO, REACH, SimTime(1000));
    assert_eq!(memory.teammates().collect::<Vec<_>>(), [Vec2::X]);
    memory.remove_stale(Vec2::ZERO, REACH, SimTime(3501));
    assert_eq!(memory.teammates().count(), 0, "no message since");
}

#[derive(Clone, Copy, Debug)]
enum Event {
    See(u32, f32),
    Hear(u32, f32),
    HearOf(u32, f32),
    LookAway,
    Forget,
}

fn events() -> impl Strategy<Value = Event> {
    let about = || (0..60_u32, -4.0..4.0_f32);
    prop_oneof![
        4 => about().prop_map(|(target, x)| Event::See(target, x)),
        4 => about().prop_map(|(target, x)| Event::Hear(target, x)),
        1 => about().prop_map(|(robot, x)| Event::HearOf(robot, x)),
        1 => Just(Event::LookAway),
        1 => Just(Event::Forget),
    ]
}

proptest! {
    /// After any events, each target is in memory once, in order. The targets in sight are those last seen, and the
    /// heartbeat has room for them.
    #[test]
    fn memory_keeps_order_and_bounds(sequence in prop::collection::vec(events(), 0..200)) {
        let mut memory = Memory::default();
        let mut in_sight = std::collections::BTreeSet::new();
        for (event, step) in sequence.into_iter().zip(0..) {
            let now = SimTime(100 * step);
            match event {
                Event::See(target, x) if in_sight.len() < MAX_SENSED_TARGETS => {
                    memory.add_reading(sighting(target, x, now.0), FASTEST_M_S);
                    in_sight.insert(target);
                }
                Event::See(..) => {}
                Event::Hear(target, x) => memory.add_message(sighting(target, x, now.0), FASTEST_M_S),
                Event::HearOf(robot, x) => memory.add_teammate(RobotId(robot), x * Vec2::X, now),
                Event::LookAway => {
                    memory.clear_in_sight();
                    in_sight.clear();
                }
                Event::Forget => memory.remove_stale(Vec2::ZERO, REACH, now),
            }
            let shared: SharedSightings = memory.in_sight().collect();
            let targets: Vec<u32> = shared.iter().map(|sighting| sighting.target).collect();
            prop_assert_eq!(&targets, &in_sight.iter().copied().collect::<Vec<_>>());
            let bytes = proto::codec::encode(&shared).unwrap();
            prop_assert!(bytes.len() <= MAX_KNOWLEDGE_BYTES);
        }
    }
}
