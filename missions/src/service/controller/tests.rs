//! A robot's knowledge of points, and its estimate of progress.

use std::sync::Arc;

use glam::Vec2;
use proptest::prelude::*;
use proto::mission::MAX_KNOWLEDGE_BYTES;
use proto::readings::{Pose, Readings};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Obstacle, Scenario};

use super::ServiceController;
use super::briefing::Briefing;
use super::memory::Memory;
use super::progress::Progress;
use crate::fixtures::{parse, resolve};
use crate::service::bus::{MAX_SHARED, ObservedFact, PointFact, SharedKnowledge};
use crate::service::data::ServiceSection;

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

fn controller(scenario: Scenario) -> ServiceController {
    let setup = resolve(scenario);
    let briefing = Arc::new(Briefing::from_setup(&setup));
    ServiceController::new(RobotId(0), &setup, &briefing)
}

fn memory() -> Memory {
    Memory::new((0..40).map(TaskId), vec![1.0, 0.5])
}

fn fact(point: u32, round: u32, left_s: f32) -> PointFact {
    PointFact {
        point,
        kind: point % 2,
        round,
        at: Vec2::new((point % 12) as f32, 3.0),
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
    proptest::collection::vec((0..2_u32, proptest::bool::ANY, 0.0..30.0_f32), 1..20).prop_map(
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
    fn the_shared_knowledge_fits_in_a_heartbeat(points in proptest::collection::btree_set(0..40_u32, 1..40)) {
        let briefing = briefing("known = 'sight'");
        let mut memory = memory();
        for point in &points {
            memory.merge(&briefing, known(fact(*point, u32::MAX, f32::MAX), 1e6));
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
    assert!(briefing.is_plausible(&sound, SimTime::ZERO));
    let is_plausible = |fact: PointFact| briefing.is_plausible(&fact, SimTime::ZERO);
    assert!(!is_plausible(PointFact { point: 40, ..sound }));
    assert!(!is_plausible(PointFact { kind: 2, ..sound }));
    for at in [Vec2::NAN, Vec2::INFINITY] {
        assert!(!is_plausible(PointFact { at, ..sound }), "{at}");
    }
    for left_s in [f32::NAN, -1.0, f32::INFINITY] {
        assert!(!is_plausible(PointFact { left_s, ..sound }), "{left_s}");
    }
}

/// A fact of a later round replaces all earlier ones, so that its round must have begun.
#[test]
fn rounds_that_cannot_have_begun_are_rejected() {
    let text = "[service]\n\
         [[service.kinds]]\nname = 'garbage'\nwork_s = { min = 1, max = 1 }\n\
         [[service.kinds]]\nname = 'dust'\nwork_s = { min = 1, max = 1 }\nperiod_s = 10\n\
         [[service.points]]\nkind = 'garbage'\nx_m = 3\ny_m = 3\n\
         [[service.points]]\nkind = 'dust'\nx_m = 4\ny_m = 3\narrival_s = 5\nvalue = 2\n\
         [[service.points]]\nkind = 'garbage'\nx_m = 5\ny_m = 3\ndeliver_to = [2, 2]\n";
    let briefing = Briefing::from_setup(&resolve(parse(text)));
    let is_plausible = |point: u32, round, now_s| {
        let fact = fact(point, round, 1.0);
        briefing.is_plausible(&fact, SimTime::from_secs_f64(now_s))
    };
    assert!(is_plausible(0, 0, 0.0));
    assert!(!is_plausible(0, 1, 1e6), "p0 does not come back");
    // p1 comes back at 15 s and 25 s.
    assert!(is_plausible(1, 1, 15.0) && is_plausible(1, 2, 25.0));
    assert!(!is_plausible(1, 2, 24.9));
    // A lost load of p2 begins a round.
    assert!(is_plausible(2, 1, 1.0) && !is_plausible(2, u32::MAX, 1.0));
}

/// A wall divides the room. A point behind it, or with its delivery there, does not keep the robot from the other point
/// of the kind.
#[test]
fn an_unreachable_point_does_not_disable_its_kind() {
    let behind = "x_m = 9\ny_m = 3\npriority = 1";
    let delivered_behind = "x_m = 2\ny_m = 3\ndeliver_to = [9, 3]";
    let near = "x_m = 2\ny_m = 3";
    for (first, expected) in [(behind, 1), (delivered_behind, 1), (near, 0)] {
        let mut scenario = parse(&format!(
            "[service]\ntasks = 'kinds'\ncosts = 'path'\n\
             [[service.kinds]]\nname = 'box'\nwork_s = {{ min = 1, max = 1 }}\n\
             [[service.points]]\nkind = 'box'\n{first}\n\
             [[service.points]]\nkind = 'box'\nx_m = 4\ny_m = 4\n"
        ));
        let places: Vec<Vec2> = ServiceSection::of(&scenario)
            .points
            .iter()
            .map(|point| Vec2::new(point.x_m, point.y_m))
            .collect();
        scenario.obstacles = vec![Obstacle {
            x_m: 6.0,
            y_m: 0.0,
            width_m: 0.2,
            height_m: scenario.room.height_m,
            penetrability: 0.0,
        }];
        let mut controller = controller(scenario);
        for (at, point) in places.into_iter().zip(0..) {
            let fact = PointFact {
                point,
                kind: 0,
                at,
                ..fact(0, 0, 1.0)
            };
            controller.learn(fact, SimTime::ZERO);
        }
        let from = Vec2::new(2.0, 2.0);
        let chosen = controller.point_of(TaskId(0), from);
        let chosen = chosen.map(|known| known.fact.point);
        assert_eq!(chosen, Some(expected), "{first}");
        let origin = controller.briefing.origin(from);
        assert!(controller.may_begin(TaskId(0), Some(&origin)), "{first}");
        assert!(controller.seconds_in_window(from, &[], TaskId(0)).is_some());
    }
}

/// The robot sees the effect of its last step at the deadline. Then it has the load only if the work was complete.
#[test]
fn work_that_ends_in_the_last_step_before_the_deadline_counts_as_load() {
    let text = "[service]\n[[service.kinds]]\nname = 'box'\nwork_s = { min = 1, max = 1 }\n\
         [[service.points]]\nkind = 'box'\nx_m = 3\ny_m = 3\ndemand = 2\ndeadline_s = 20\n\
         [[robots]]\nname = 'gold'\ncapacity = 3\n";
    let over = |left_s| PointFact {
        kind: 0,
        ..fact(0, 0, left_s)
    };
    for (steps, now_s, takes) in [(2, 20.0, true), (1, 20.0, false), (1, 19.9, true)] {
        let mut controller = controller(parse(text));
        let mut progress = Progress::new(&over(1.0));
        for _ in 0..steps {
            progress.work(0.5);
        }
        controller.note_load(&over(0.0), &progress, SimTime::from_secs_f64(now_s));
        assert_eq!(!controller.has_capacity(0.0, 0), takes, "{steps} steps");
    }
    let mut late = Progress::new(&over(0.0));
    late.work(0.5);
    assert!(
        !late.is_complete(),
        "the point was over before the robot's first step"
    );
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
        let nearest = memory.nearest(&briefing, kind, Vec2::new(5.0, 3.0), SimTime::ZERO);
        nearest.map(|known| known.fact.point)
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

proptest! {
    /// A robot that remembers the nearest charger decides like a robot that searches all chargers in each step.
    #[test]
    fn the_last_nearest_charger_changes_no_decision(
        steps in proptest::collection::vec((0.5..11.5_f32, 0.5..8.5_f32, 1.0..400.0_f32), 1..20),
        wall in proptest::bool::ANY,
    ) {
        let chargers = [(1, 1), (11, 1), (1, 8), (11, 8), (6, 8)].map(|(x, y)| {
            format!("[[service.chargers]]\nx_m = {x}\ny_m = {y}\nrate_w = 9\n")
        });
        let mut scenario = parse(&format!(
            "energy = {{ capacity_j = 400, idle_w = 2, drive_w = 8 }}\n\
             [service]\nreserve = 0.1\ncosts = 'path'\n{}\
             [[service.kinds]]\nname = 'box'\nwork_s = {{ min = 1, max = 1 }}\n\
             [[service.points]]\nkind = 'box'\nx_m = 4\ny_m = 4\n",
            chargers.concat()
        ));
        if wall {
            scenario.obstacles = vec![Obstacle {
                x_m: 3.0,
                y_m: 0.0,
                width_m: 0.2,
                height_m: 7.0,
                penetrability: 0.0,
            }];
        }
        let new = controller(scenario);
        let mut remembers = new.clone();
        for (x_m, y_m, energy_j) in steps {
            let pose = Pose {
                position: Vec2::new(x_m, y_m),
                ..Pose::default()
            };
            let readings = Readings {
                pose: Some(pose),
                energy_j: Some(energy_j),
                ..Readings::default()
            };
            let mut forgets = new.clone();
            forgets.update_charging(&readings, SimTime::ZERO);
            remembers.update_charging(&readings, SimTime::ZERO);
            prop_assert_eq!(remembers.recharge.charger, forgets.recharge.charger);
            remembers.recharge.charger = None;
        }
    }
}
