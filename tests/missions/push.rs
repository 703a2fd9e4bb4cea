//! The push mission as in docs/missions/push.md, from the logs of whole runs.

use alliance_tests::runs::{builtin, play};
use missions::push::data::BAR_STUCK;
use proto::tick::Outcome;
use run_log::EventRow;
use scenario::Scenario;
use scenario::fault::{Fault, MissionFault, Order};

/// Returns the scenario of Parker's box with these faults only.
fn parker_box(faults: &[(f64, Fault)]) -> Scenario {
    let mut scenario = builtin("parker-box");
    let orders = faults.iter().map(|(at_s, fault)| Order {
        at_s: Some(*at_s),
        ..Order::now(fault.clone())
    });
    scenario.faults.timeline = orders.collect();
    scenario
}

fn kill() -> (f64, Fault) {
    (KILLED_S, Fault::Kill("blue".to_owned()))
}

fn add() -> (f64, Fault) {
    (ADDED_S, Fault::Add("genghis".to_owned()))
}

/// The times of blue's kill and of genghis' addition, in s.
const KILLED_S: f64 = 75.0;
const ADDED_S: f64 = 120.0;

fn events(scenario: &Scenario, expected: Outcome) -> Vec<EventRow> {
    let (outcome, log) = play(scenario.clone(), 1);
    assert_eq!(outcome, expected);
    log.rows().unwrap()
}

/// A stroke: its end time in s, the robot, the end of the bar, and the distance in m.
#[derive(Clone, Debug, PartialEq)]
struct Stroke {
    at_s: f64,
    robot: String,
    end: String,
    moved_m: f64,
}

fn strokes(events: &[EventRow]) -> Vec<Stroke> {
    let pushed = events.iter().filter(|event| event.kind == "pushed");
    let strokes = pushed.map(|event| Stroke {
        at_s: event.t_ms.as_secs_f64(),
        robot: event.robot.clone(),
        end: event.subject.clone(),
        moved_m: event.detail.trim_end_matches(" m").parse().unwrap(),
    });
    strokes.collect()
}

/// Checks that each stroke at an end is by this robot.
#[track_caller]
fn assert_ends_kept(strokes: &[Stroke], left: &str, right: &str) {
    for stroke in strokes {
        let expected = if stroke.end == "left" { left } else { right };
        assert_eq!(stroke.robot, expected, "{stroke:?}");
    }
}

/// Returns the times of a robot's activations of a behavior from a time on, in s.
fn activations(events: &[EventRow], robot: &str, behavior: &str, from_s: f64) -> Vec<f64> {
    let of_robot = events.iter().filter(|event| event.robot == robot);
    let rows = of_robot.filter(|event| event.kind == "activated" && event.detail == behavior);
    let times = rows.map(|row| row.t_ms.as_secs_f64());
    times.filter(|at_s| *at_s >= from_s).collect()
}

fn assert_ends_alternate(strokes: &[Stroke]) {
    for pair in strokes.windows(2) {
        assert_ne!(pair[0].end, pair[1].end, "{pair:?}");
    }
}

/// Two robots without faults: after two simultaneous strokes the ends alternate, and each robot keeps its end.
///
/// The strokes are 3.7 s apart: one step for the message, 2.0 s of motivation, and a push at 0.2 m/s that moves the
/// end by 0.37 m.
#[test]
fn two_robots_push_their_ends_alternately() {
    let all = strokes(&events(&parker_box(&[]), Outcome::Complete));
    assert_eq!(all[0].at_s, all[1].at_s, "both ends are due at first");
    assert_ends_alternate(&all[2..]);
    assert_ends_kept(&all, "red", "blue");
    let after_first = &all[3..all.len() - 1];
    assert!(after_first.len() >= 30, "{}", after_first.len());
    for pair in after_first.windows(2) {
        let apart_s = pair[1].at_s - pair[0].at_s;
        assert!((apart_s - 3.7).abs() < 0.151, "{pair:?}");
        assert!((pair[1].moved_m - 0.37).abs() < 0.02, "{pair:?}");
    }
    // 7 m take 18 or 19 strokes at each end.
    for end in ["left", "right"] {
        let count = all.iter().filter(|stroke| stroke.end == end).count();
        assert!((18..=21).contains(&count), "{count} at the {end} end");
    }
}

/// Blue is killed halfway. Red takes over the other end after the silence of τ and 8 s of impatience, and then pushes
/// both ends alternately.
#[test]
fn a_lone_robot_pushes_both_ends_alternately() {
    let all = events(&parker_box(&[kill()]), Outcome::Complete);
    let red = activations(&all, "red", "push(right)", 0.0);
    // The latest time: blue's last heartbeat plus τ, or the end of red's stroke, and then the impatience.
    let mut alone = strokes(&all);
    let mut before = alone.iter().filter(|stroke| stroke.at_s < red[0]);
    let last_left = before.rfind(|stroke| stroke.end == "left").unwrap().at_s;
    let latest_s = (KILLED_S + 3.0).max(last_left) + 8.0 + 0.15;
    let is_in_time = KILLED_S < red[0] && red[0] <= latest_s;
    assert!(is_in_time, "{red:?} {last_left}");
    alone.retain(|stroke| stroke.at_s > red[0]);
    assert!(alone.len() > 10);
    assert_ends_alternate(&alone);
    assert_ends_kept(&alone, "red", "red");
    // A lone robot is slower per meter because of backward motion, driving, and 8 s of impatience.
    let arrived = all.iter().find(|event| event.kind == "arrived").unwrap();
    let slower = (arrived.t_ms.as_secs_f64() - KILLED_S) / (150.75 - KILLED_S);
    assert!((4.0..9.0).contains(&slower), "{slower}");
}

/// Genghis is added: red makes its last stroke at the right end within 20 s. Genghis needs twice as long for a
/// stroke, and red waits.
#[test]
fn after_an_addition_each_robot_keeps_its_end() {
    let all = events(&parker_box(&[kill(), add()]), Outcome::Complete);
    let mut all = strokes(&all);
    let of_genghis = all.iter().filter(|stroke| stroke.robot == "genghis");
    assert!(of_genghis.clone().count() > 3, "{all:?}");
    assert!(of_genghis.clone().all(|stroke| stroke.end == "right"));
    all.retain(|stroke| stroke.at_s > ADDED_S + 20.0);
    assert_ends_kept(&all, "red", "genghis");
}

/// A babbling genghis yields after ψ, 30 s after its activation, and red takes its end within a second.
#[test]
fn a_babbling_robot_yields_after_psi() {
    let babble = (180.0, Fault::Babble("genghis".to_owned()));
    let mut scenario = parker_box(&[kill(), add(), babble]);
    scenario.limit_s = 260.0;
    let all = events(&scenario, Outcome::TimeLimit);
    let mut of_genghis = all.iter().filter(|event| event.robot == "genghis");
    let yielded = of_genghis.find(|event| event.reason == "acquiesced-psi");
    let yielded_s = yielded.unwrap().t_ms.as_secs_f64();
    let began = activations(&all, "genghis", "push(right)", 0.0);
    let began = began.into_iter().rfind(|at_s| *at_s < yielded_s).unwrap();
    let worked_s = yielded_s - began;
    assert!((worked_s - 30.0).abs() < 0.151, "{began} {yielded_s}");
    let red = activations(&all, "red", "push(right)", 180.0);
    let later_s = red[0] - yielded_s;
    assert!((0.0..1.0).contains(&later_s), "{red:?} {yielded_s}");
}

/// A robot gives up a stuck bar after λ, and continues when the bar moves again.
#[test]
fn a_stuck_bar_is_given_up_and_resumed() {
    let stuck = MissionFault::new(BAR_STUCK, &[("stuck_s", 80.0)]);
    let scenario = parker_box(&[(20.0, Fault::Mission(stuck))]);
    let all = events(&scenario, Outcome::Complete);
    let mut slipped = all.iter().filter(|event| event.kind == "slipped");
    assert!(slipped.any(|event| event.reason == "fixed"));
    let mut reasons = all.iter().map(|event| event.reason.as_str());
    assert!(reasons.any(|reason| reason.contains("lambda") || reason.contains("psi")));
    let times = strokes(&all).into_iter().map(|stroke| stroke.at_s);
    let (during, after): (Vec<f64>, Vec<f64>) = times
        .filter(|at_s| *at_s > 20.5)
        .partition(|at_s| *at_s < 99.9);
    assert!(during.is_empty(), "{during:?}");
    assert!(after.iter().any(|at_s| *at_s > 100.0));
}
