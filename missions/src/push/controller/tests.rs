//! Tests of a robot's knowledge from readings and messages.

use proptest::prelude::*;
use proto::readings::Pose;
use scenario::Scenario;

use super::memory::{BarKnowledge, shared_knowledge};
use super::*;
use crate::fixtures::{parse, resolve};
use crate::push::bar::with_end;
use crate::push::bus::{MAX_REPORTED_BARS, Stroke};

fn scenario() -> Scenario {
    parse("[push]\n[[push.bars]]\nx_m = 2\ny_m = 4\ngoal_x_m = 9\n")
}

fn section() -> PushSection {
    PushSection::of(&scenario()).clone()
}

/// The bar with its right end at (3, 2.8) and that lead of its left end.
fn leading(lead_m: f32) -> Pose {
    with_end(Vec2::new(3.0, 2.8), BarEnd::Right, lead_m, 2.4)
}

fn known() -> BarKnowledge {
    BarKnowledge::new(0, leading(0.0))
}

fn stroke(end: BarEnd, at: SimTime) -> Stroke {
    Stroke { end, at }
}

fn due(known: &BarKnowledge, now: SimTime) -> [bool; 2] {
    BarEnd::BOTH.map(|end| known.is_due(end, now, &section()))
}

#[test]
fn the_ends_are_due_in_turns() {
    let now = SimTime(10_000);
    let mut bar = known();
    assert_eq!(due(&bar, now), [true, true], "at first both");
    for (end, at_ms, expected) in [
        (BarEnd::Left, 5_000, [false, true]),
        // At equal times the right end counts as the later one.
        (BarEnd::Right, 5_000, [true, false]),
        (BarEnd::Left, 5_000, [true, false]),
        // An older message.
        (BarEnd::Left, 4_000, [true, false]),
    ] {
        bar.add_stroke(stroke(end, SimTime(at_ms)));
        assert_eq!(due(&bar, now), expected);
    }
    // Neither end of a bar over the line is due.
    let over = Pose {
        position: Vec2::new(9.1, 4.0),
        heading_rad: 0.0,
    };
    bar.add_reading(over, now, &section());
    assert_eq!(due(&bar, SimTime(19_000)), [false, false]);
}

#[test]
fn a_leading_end_is_not_due_and_a_lagging_end_at_rest_is_due() {
    let mut bar = known();
    bar.add_stroke(stroke(BarEnd::Right, SimTime(1_000)));
    bar.add_reading(leading(0.21), SimTime(2_000), &section());
    // A teammate may still push.
    assert_eq!(due(&bar, SimTime(2_500)), [false, false]);
    assert_eq!(due(&bar, SimTime(3_000)), [false, true]);
}

/// A stroke without a message is detected: the bar has turned and is at rest.
#[test]
fn a_stroke_without_a_message_is_detected() {
    let mut bar = known();
    bar.add_stroke(stroke(BarEnd::Left, SimTime(1_000)));
    for (step, lead_m) in (0..10).map(|step| (step, -0.02 * step as f32)) {
        bar.add_reading(leading(lead_m), SimTime(1_050 + 50 * step), &section());
    }
    assert!(!due(&bar, SimTime(1_550))[0], "the bar still moves");
    for step in 0..30 {
        bar.add_reading(leading(-0.18), SimTime(1_550 + 50 * step), &section());
    }
    assert_eq!(bar.report.last.map(|last| last.end), Some(BarEnd::Right));
    assert!(due(&bar, SimTime(3_000))[0]);
}

proptest! {
    /// The newest messages count, in any order and with copies.
    #[test]
    fn messages_may_arrive_in_any_order(messages in prop::collection::vec((0..50_u64, -0.5..0.5_f32, any::<bool>()), 1..12), seed in any::<u64>()) {
        let section = section();
        let message_of = |&(at, lead_m, left): &(u64, f32, bool)| BarReport {
            bar: 0,
            pose: leading(lead_m),
            seen: SimTime(1 + 2 * at),
            last: Some(Stroke { end: if left { BarEnd::Left } else { BarEnd::Right }, at: SimTime(at) }),
        };
        // Equal times have equal content: all robots see the same bar.
        let mut messages = messages;
        messages.sort_by_key(|message| message.0);
        messages.dedup_by_key(|message| message.0);
        let mut in_order = known();
        messages.iter().for_each(|message| in_order.merge(&message_of(message), &section));
        let mut mixed = known();
        let turn = (seed % messages.len() as u64) as usize;
        for message in messages[turn..].iter().chain(&messages).chain(&messages[..turn]) {
            mixed.merge(&message_of(message), &section);
        }
        prop_assert_eq!(mixed.report, in_order.report);
    }
}

/// A heartbeat has a bounded size, and successive heartbeats contain all bars.
#[test]
fn heartbeats_contain_many_bars_in_turn() {
    let many: Vec<BarKnowledge> = (0..30)
        .map(|bar| BarKnowledge::new(bar, leading(0.0)))
        .collect();
    let mut shared = std::collections::BTreeSet::new();
    for now in 0..40 {
        let knowledge = shared_knowledge(&many, SimTime(500 * now));
        assert!(knowledge.len() <= MAX_REPORTED_BARS);
        shared.extend(knowledge.iter().map(|shared| shared.bar));
    }
    assert_eq!(shared.len(), 30);
    let largest = BarReport {
        bar: u32::MAX,
        pose: leading(0.1),
        seen: SimTime(u64::MAX),
        last: Some(stroke(BarEnd::Left, SimTime(u64::MAX))),
    };
    let knowledge: SharedKnowledge = std::iter::repeat_n(largest, MAX_REPORTED_BARS).collect();
    let bytes = proto::codec::encode(&knowledge).unwrap().len();
    assert!(bytes <= proto::mission::MAX_KNOWLEDGE_BYTES, "{bytes}");
}

/// A message may contain anything.
#[test]
fn impossible_messages_are_ignored() {
    let mut pusher = Pusher::new(RobotId(0), &resolve(scenario()));
    pusher.now = SimTime(1_000);
    let good = BarReport {
        bar: 0,
        pose: leading(0.1),
        seen: SimTime(900),
        last: None,
    };
    let posed = |x, y, heading_rad| {
        let position = Vec2::new(x, y);
        let pose = Pose {
            position,
            heading_rad,
        };
        BarReport { pose, ..good }
    };
    for bad in [
        BarReport { bar: 7, ..good },
        posed(f32::NAN, f32::NAN, 0.0),
        posed(f32::INFINITY, f32::INFINITY, 0.0),
        posed(-4.0, 2.0, 0.0),
        posed(4.0, 2.0, f32::NAN),
        posed(4.0, 2.0, 3.0),
    ] {
        pusher.receive(bad);
        assert_eq!(pusher.known[0].report.seen, SimTime::ZERO, "{bad:?}");
    }
    // A time in the future is limited to now; otherwise it would count for ever.
    let seen = SimTime(u64::MAX);
    pusher.receive(BarReport { seen, ..good });
    assert_eq!(pusher.known[0].report.seen, SimTime(1_000));
}
