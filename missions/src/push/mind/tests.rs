//! What a robot makes of what it sees and hears of a bar.

use alliance_proto::readings::Pose;
use alliance_proto::scenario::{Scenario, Setup};
use proptest::prelude::*;

use super::memory::{Known, lore};
use super::*;
use crate::Registry;
use crate::push::bar::with_end;
use crate::push::bus::{Stroke, TOLD_MOST};

fn section() -> PushSection {
    let text = "[push]\n[[push.bars]]\nx_m = 2\ny_m = 4\ngoal_x_m = 9\n";
    let scenario = Scenario::parse("s.toml", text, &Registry::built_in().vocabulary()).unwrap();
    PushSection::of(&scenario).clone()
}

/// The bar with its right end at (3, 2.8), so much ahead on the left.
fn leading(lead_m: f32) -> Pose {
    with_end(Vec2::new(3.0, 2.8), End::Right, lead_m, 2.4)
}

fn known() -> Known {
    Known::new(0, leading(0.0))
}

fn stroke(end: End, at: SimTime) -> Stroke {
    Stroke { end, at }
}

fn due(known: &Known, now: SimTime) -> [bool; 2] {
    End::BOTH.map(|end| known.is_due(end, now, &section()))
}

#[test]
fn the_ends_are_due_in_turns() {
    let now = SimTime(10_000);
    let mut bar = known();
    assert_eq!(due(&bar, now), [true, true], "at first both");
    bar.stroke(stroke(End::Left, SimTime(5_000)));
    assert_eq!(due(&bar, now), [false, true]);
    // At one time: the right one counts as the last.
    bar.stroke(stroke(End::Right, SimTime(5_000)));
    assert_eq!(due(&bar, now), [true, false]);
    bar.stroke(stroke(End::Left, SimTime(5_000)));
    assert_eq!(due(&bar, now), [true, false]);
    // Old news.
    bar.stroke(stroke(End::Left, SimTime(4_000)));
    assert_eq!(due(&bar, now), [true, false]);
}

#[test]
fn an_end_that_leads_by_half_a_stroke_is_not_due_and_one_that_lags_is_whoever_pushed_last() {
    let mut bar = known();
    bar.stroke(stroke(End::Right, SimTime(1_000)));
    bar.see(leading(0.21), SimTime(2_000), &section());
    // Somebody may be pushing still.
    assert_eq!(due(&bar, SimTime(2_500)), [false, false]);
    assert_eq!(due(&bar, SimTime(3_000)), [false, true]);
}

/// A stroke that nobody tells of is seen: the bar has turned, and stands still.
#[test]
fn who_hears_nothing_sees_that_the_other_end_was_pushed() {
    let mut bar = known();
    bar.stroke(stroke(End::Left, SimTime(1_000)));
    for (step, lead_m) in (0..10).map(|step| (step, -0.02 * step as f32)) {
        bar.see(leading(lead_m), SimTime(1_050 + 50 * step), &section());
    }
    assert!(!due(&bar, SimTime(1_550))[0], "it moves still");
    for step in 0..30 {
        bar.see(leading(-0.18), SimTime(1_550 + 50 * step), &section());
    }
    assert_eq!(bar.told.last.map(|last| last.end), Some(End::Right));
    assert!(due(&bar, SimTime(3_000))[0]);
}

#[test]
fn a_bar_over_the_line_is_done() {
    let mut bar = known();
    let over = Pose {
        position: Vec2::new(9.1, 4.0),
        heading_rad: 0.0,
    };
    bar.see(over, SimTime(1_000), &section());
    assert_eq!(due(&bar, SimTime(9_000)), [false, false]);
}

proptest! {
    /// In whatever order facts come, and how often: the newest hold.
    #[test]
    fn facts_come_in_any_order(facts in prop::collection::vec((0..50_u64, -0.5..0.5_f32, any::<bool>()), 1..12), seed in any::<u64>()) {
        let section = section();
        let told = |&(at, lead_m, left): &(u64, f32, bool)| Told {
            bar: 0,
            pose: leading(lead_m),
            seen: SimTime(1 + 2 * at),
            last: Some(Stroke { end: if left { End::Left } else { End::Right }, at: SimTime(at) }),
        };
        // Equal times have equal facts: whoever sees a bar at a time sees the same.
        let mut facts = facts;
        facts.sort_by_key(|fact| fact.0);
        facts.dedup_by_key(|fact| fact.0);
        let mut in_order = known();
        facts.iter().for_each(|fact| in_order.learn(&told(fact), &section));
        let mut mixed = known();
        let turn = (seed % facts.len() as u64) as usize;
        for fact in facts[turn..].iter().chain(&facts).chain(&facts[..turn]) {
            mixed.learn(&told(fact), &section);
        }
        prop_assert_eq!(mixed.told, in_order.told);
    }
}

/// What is told is bounded, and in time it is told of all.
#[test]
fn of_many_bars_all_are_told_in_turn() {
    let many: Vec<Known> = (0..30).map(|bar| Known::new(bar, leading(0.0))).collect();
    let mut told = std::collections::BTreeSet::new();
    for now in 0..40 {
        let lore = lore(&many, SimTime(500 * now));
        assert!(lore.len() <= TOLD_MOST);
        told.extend(lore.iter().map(|told| told.bar));
    }
    assert_eq!(told.len(), 30);
    let largest = Told {
        bar: u16::MAX,
        pose: leading(0.1),
        seen: SimTime(u64::MAX),
        last: Some(stroke(End::Left, SimTime(u64::MAX))),
    };
    let lore: Lore = std::iter::repeat_n(largest, TOLD_MOST).collect();
    let bytes = alliance_proto::codec::encode(&lore).unwrap();
    assert!(
        bytes.len() <= alliance_proto::mission::LORE_MAX,
        "{}",
        bytes.len()
    );
}

/// Anybody may say anything.
#[test]
fn what_cannot_be_is_not_believed() {
    let text = "[push]\n[[push.bars]]\nx_m = 2\ny_m = 4\ngoal_x_m = 9\n";
    let scenario = Scenario::parse("s.toml", text, &Registry::built_in().vocabulary()).unwrap();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let mut mind = Pusher::new(RobotId(0), &setup);
    mind.now = SimTime(1_000);
    let good = Told {
        bar: 0,
        pose: leading(0.1),
        seen: SimTime(900),
        last: None,
    };
    let pose = |position, heading_rad| Pose {
        position,
        heading_rad,
    };
    for bad in [
        Told { bar: 7, ..good },
        Told {
            pose: pose(Vec2::splat(f32::NAN), 0.0),
            ..good
        },
        Told {
            pose: pose(Vec2::splat(f32::INFINITY), 0.0),
            ..good
        },
        Told {
            pose: pose(Vec2::new(-4.0, 2.0), 0.0),
            ..good
        },
        Told {
            pose: pose(Vec2::new(4.0, 2.0), f32::NAN),
            ..good
        },
        Told {
            pose: pose(Vec2::new(4.0, 2.0), 3.0),
            ..good
        },
    ] {
        mind.hear(bad);
        assert_eq!(mind.known[0].told.seen, SimTime::ZERO, "{bad:?}");
    }
    // Nor that somebody has seen what is to come: else it would hold for ever.
    mind.hear(Told {
        seen: SimTime(u64::MAX),
        ..good
    });
    assert_eq!(mind.known[0].told.seen, SimTime(1_000));
}
