//! A robot's knowledge of points, and its estimate of progress.

use glam::Vec2;
use proptest::prelude::*;
use proto::mission::MAX_KNOWLEDGE_BYTES;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::briefing::Briefing;
use super::memory::Memory;
use super::progress::Progress;
use crate::fixtures::{parse, resolve};
use crate::service::bus::{MAX_SHARED, ObservedFact, PointFact, SharedKnowledge};

/// Creates a briefing with two kinds of work in a room of 12 × 9 m: garbage is kept, dust is not.
fn briefing(section: &str) -> Briefing {
    let text = format!(
        "[service]\n{section}\n\
         [[service.kinds]]\nname = 'garbage'\nwork_s = {{ min = 1, max = 60 }}\n\
         [[service.kinds]]\nname = 'dust'\nwork_s = {{ min = 1, max = 60 }}\nkept = false\n\
         [[service.random]]\nn = 40\n"
    );
    Briefing::from_setup(&resolve(parse(&text)))
}

fn memory() -> Memory {
    Memory::new((0..40).map(TaskId), vec![1.0, 0.5])
}

fn fact(point: u16, round: u16, left_s: f32) -> PointFact {
    PointFact {
        point,
        kind: point % 2,
        round,
        at: Vec2::new(f32::from(point % 12), 3.0),
        left_s,
    }
}

fn known(fact: PointFact, sensed_s: f64) -> ObservedFact {
    ObservedFact {
        fact,
        sensed: SimTime::from_secs_f64(sensed_s),
    }
}

/// Draws the history of a point: rounds increase, and the work left decreases within a round.
fn history() -> impl Strategy<Value = Vec<ObservedFact>> {
    proptest::collection::vec((0..2_u16, proptest::bool::ANY, 0.0..30.0_f32), 1..20).prop_map(
        |steps| {
            let (mut round, mut left_s) = (0, 60.0_f32);
            let history = (1..).zip(steps).map(|(second, (back, is_over, work_s))| {
                if back == 1 {
                    (round, left_s) = (round + 1, 60.0);
                } else if left_s > 0.0 {
                    left_s = if is_over {
                        0.0
                    } else {
                        (left_s - work_s).max(0.5)
                    };
                }
                known(fact(4, round, left_s), f64::from(second))
            });
            history.collect()
        },
    )
}

proptest! {
    /// Facts arrive late, repeatedly and in any order. At the end the newest fact holds, and the task is applicable
    /// while work is left.
    #[test]
    fn the_newest_fact_holds(facts in history(), order in proptest::collection::vec(0..20_usize, 0..40)) {
        let briefing = briefing("");
        let mut memory = memory();
        for index in order {
            memory.merge(&briefing, facts[index % facts.len()]);
        }
        let newest = facts[facts.len() - 1];
        memory.merge(&briefing, newest);
        for late in &facts {
            memory.merge(&briefing, *late);
        }
        prop_assert_eq!(memory.fact(4), Some(&newest.fact));
        let applicable: Vec<bool> = memory.applicable(&briefing, SimTime::ZERO).collect();
        let expected: Vec<bool> = (0..40).map(|task| task == 4 && newest.fact.left_s > 0.0).collect();
        prop_assert_eq!(applicable, expected);
    }

    /// The content fits in a heartbeat, and every point is sent within a minute.
    #[test]
    fn the_shared_knowledge_fits_in_a_heartbeat(points in proptest::collection::btree_set(0..40_u16, 1..40)) {
        let briefing = briefing("known = 'sight'");
        let mut memory = memory();
        for point in &points {
            memory.merge(&briefing, known(fact(*point, u16::MAX, f32::MAX), 1e6));
        }
        let mut sent = std::collections::BTreeSet::new();
        for second in 0..60 {
            let heartbeat: SharedKnowledge = memory.shared_knowledge(&briefing, SimTime(1000 * second));
            prop_assert!(heartbeat.len() <= MAX_SHARED);
            let bytes = proto::codec::encode(&heartbeat).unwrap();
            prop_assert!(bytes.len() <= MAX_KNOWLEDGE_BYTES, "{} bytes", bytes.len());
            sent.extend(heartbeat.iter().map(|known| known.fact.point));
        }
        prop_assert_eq!(sent, points);
    }
}

/// Received facts are checked, because a faulty teammate may send any values.
#[test]
fn implausible_facts_are_rejected() {
    let briefing = briefing("");
    let sound = fact(39, 0, 1.0);
    assert!(briefing.is_plausible(&sound));
    let is_plausible = |fact: PointFact| briefing.is_plausible(&fact);
    assert!(!is_plausible(PointFact { point: 40, ..sound }));
    assert!(!is_plausible(PointFact { kind: 2, ..sound }));
    for at in [Vec2::NAN, Vec2::INFINITY] {
        assert!(!is_plausible(PointFact { at, ..sound }), "{at}");
    }
    for left_s in [f32::NAN, -1.0, f32::INFINITY] {
        assert!(!is_plausible(PointFact { left_s, ..sound }), "{left_s}");
    }
}

#[test]
fn the_nearest_open_point_that_the_robot_can_serve_is_selected() {
    let briefing = briefing("tasks = 'kinds'");
    let mut memory = Memory::new([TaskId(0), TaskId(1)].into_iter(), vec![1.0, 0.0]);
    for point in [2, 4, 8] {
        memory.merge(&briefing, known(fact(point, 0, 5.0), 1.0));
    }
    memory.merge(&briefing, known(fact(3, 0, 5.0), 1.0));
    let nearest = |memory: &Memory, kind| {
        let nearest = memory.nearest(kind, Vec2::new(5.0, 3.0), SimTime::ZERO);
        nearest.map(|fact| fact.point)
    };
    let applicable = |memory: &Memory| -> Vec<bool> {
        let applicable = memory.applicable(&briefing, SimTime::ZERO);
        applicable.collect()
    };
    assert_eq!(nearest(&memory, 0), Some(4));
    assert_eq!(nearest(&memory, 1), None, "the robot has no skill for dust");
    assert_eq!(applicable(&memory), [true, false]);
    memory.merge(&briefing, known(fact(4, 0, 0.0), 2.0));
    assert_eq!(nearest(&memory, 0), Some(2), "p4 is done");
    memory.merge(&briefing, known(fact(4, 1, 5.0), 3.0));
    assert_eq!(nearest(&memory, 0), Some(4), "p4 has come back");
    // Points to which the robot found no way are left out. The task stays applicable while another point is open.
    for (failed, left) in [(4, Some(2)), (2, Some(8)), (8, None)] {
        memory.failed.fail(failed, SimTime::ZERO);
        assert_eq!(nearest(&memory, 0), left);
        assert_eq!(applicable(&memory), [left.is_some(), false]);
    }
    memory.failed.succeed(8);
    assert_eq!(nearest(&memory, 0), Some(8));
    assert_eq!(applicable(&memory), [true, false]);
}

/// 8 s in steps of 0.5 s: every fourth step completes a quarter.
#[test]
fn each_quarter_is_progress() {
    let mut progress = Progress::new(&fact(0, 0, 8.0));
    let quarters: Vec<u32> = (1..=16).filter(|_| progress.work(0.5)).collect();
    assert_eq!(quarters, [4, 8, 12, 16]);
    assert!(progress.next_step_completes());
    assert!(progress.left_s() > 0.0, "an open point has work left");

    let mut progress = Progress::new(&fact(0, 0, 8.0));
    (1..=14).for_each(|_| {
        progress.work(0.5);
    });
    assert!(!progress.next_step_completes());
    progress.work(0.5);
    assert!(progress.next_step_completes(), "another step would end it");
}

/// A robot that works beyond its estimate is slower than it estimates, and must not conclude that the point is done.
#[test]
fn a_robot_slower_than_estimated_does_not_conclude_that_a_point_is_done() {
    let mut progress = Progress::new(&fact(0, 0, 8.0));
    for _ in 0..18 {
        progress.work(0.5);
    }
    assert!(progress.next_step_completes(), "two steps may be rounding");
    progress.work(0.5);
    assert!(!progress.next_step_completes());
}
