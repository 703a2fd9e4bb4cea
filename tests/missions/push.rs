//! What push promises, from the logs of whole runs (docs/missions/push.md).

use alliance_proto::fault::{Fault, MissionFault, Order};
use alliance_proto::log::{EventRow, LogLevel};
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::tick::Outcome;
use in_process::Team;
use missions::Registry;
use missions::push::data::{BAR_STUCK, family};
use study::invariants::Invariants;

use crate::harness::Lab;
use crate::in_process::run;
use crate::recompute::log_of;

/// Parker's box, with nothing but these faults.
fn parker_box(faults: &[(f64, Fault)]) -> Scenario {
    let vocabulary = Registry::built_in().vocabulary();
    let builtin = vocabulary.builtin("parker-box").unwrap();
    let mut scenario = Scenario::parse(builtin.name, builtin.text, &vocabulary).unwrap();
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

/// When blue is killed, and genghis comes, s.
const KILLED_S: f64 = 75.0;
const ADDED_S: f64 = 120.0;

fn events(scenario: &Scenario, expected: Outcome) -> Vec<EventRow> {
    let setup = Setup::resolve(scenario.clone(), 1, None).unwrap().setup;
    let (outcome, recorder) = run(setup, LogLevel::Full);
    assert_eq!(outcome, expected);
    log_of(recorder).rows().unwrap()
}

/// A stroke: when it ended, s, by whom, at which end, and how far that came forward, m.
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

/// When a robot activates a behavior, from a time on, s.
fn activations(events: &[EventRow], robot: &str, behavior: &str, from_s: f64) -> Vec<f64> {
    let rows = events.iter().filter(|event| {
        event.kind == "activated" && event.robot == robot && event.detail == behavior
    });
    let times = rows.map(|row| row.t_ms.as_secs_f64());
    times.filter(|at_s| *at_s >= from_s).collect()
}

fn takes_turns(strokes: &[Stroke]) {
    for pair in strokes.windows(2) {
        assert_ne!(pair[0].end, pair[1].end, "{pair:?}");
    }
}

/// Two robots, undisturbed: after the first two strokes, which are at one time, the ends take turns, and each robot keeps to its own. From
/// one stroke to the next it is 3.7 s: a step until it is heard of, 2.0 s of motivation, and a push that moves the end by 0.37 m, as the
/// body moves by 0.34 m at 0.2 m/s.
#[test]
fn two_robots_push_their_ends_in_turns() {
    let all = strokes(&events(&parker_box(&[]), Outcome::Complete));
    assert_eq!(all[0].at_s, all[1].at_s, "both ends are due at first");
    takes_turns(&all[2..]);
    for stroke in &all {
        let own = if stroke.end == "left" { "red" } else { "blue" };
        assert_eq!(stroke.robot, own, "{stroke:?}");
    }
    let after_first = &all[3..all.len() - 1];
    assert!(after_first.len() >= 30, "{}", after_first.len());
    for pair in after_first.windows(2) {
        let apart_s = pair[1].at_s - pair[0].at_s;
        assert!((apart_s - 3.7).abs() < 0.151, "{pair:?}");
        assert!((pair[1].moved_m - 0.37).abs() < 0.02, "{pair:?}");
    }
    // 7 m by 18 or 19 strokes at each end.
    let at = |end: &str| all.iter().filter(|stroke| stroke.end == end).count();
    assert!((18..=21).contains(&at("left")), "{}", at("left"));
    assert!((18..=21).contains(&at("right")), "{}", at("right"));
}

/// The bar never turns by more than a stroke, and its middle keeps to its line: what leans to one side only drifts aside.
#[test]
fn the_bar_keeps_to_its_lane() {
    let setup = Setup::resolve(parker_box(&[]), 1, None).unwrap().setup;
    let mut team = Team::new(setup, LogLevel::Off, alliance_proto::log::Memory::default()).unwrap();
    while team.tick().unwrap().is_none() {
        let bar = team.simulation().world().bars()[0];
        assert!((bar.from.x - bar.to.x).abs() < 0.4, "{bar:?}");
        assert!((bar.center().y - 3.0).abs() < 0.05, "{bar:?}");
        assert!((bar.from.distance(bar.to) - 2.4).abs() < 1e-4, "{bar:?}");
    }
}

/// Blue is killed at half way: red takes over the other end when it has been silent for τ, and has been due for 8 s; from then on it makes
/// every stroke, left and right in turn.
#[test]
fn alone_a_robot_pushes_both_ends_in_turns() {
    let all = events(&parker_box(&[kill()]), Outcome::Complete);
    let red = activations(&all, "red", "push(right)", 0.0);
    // Its last heartbeat, τ; the end of red's stroke, and that it is seen.
    let last_left = strokes(&all)
        .iter()
        .rfind(|stroke| stroke.end == "left" && stroke.at_s < red[0])
        .unwrap()
        .at_s;
    let silent_s = KILLED_S + 3.0;
    assert!(red[0] > KILLED_S);
    assert!(
        red[0] <= silent_s.max(last_left) + 8.0 + 0.15,
        "{red:?} {last_left}"
    );
    let alone: Vec<Stroke> = strokes(&all)
        .into_iter()
        .filter(|it| it.at_s > red[0])
        .collect();
    assert!(alone.len() > 10);
    takes_turns(&alone);
    assert!(alone.iter().all(|stroke| stroke.robot == "red"));
    // Slower per meter than two: by what goes back, the way, and 8 s of impatience.
    let arrived = all
        .iter()
        .find(|event| event.kind == "arrived")
        .unwrap()
        .t_ms
        .as_secs_f64();
    let slower = (arrived - KILLED_S) / (150.75 - KILLED_S);
    assert!((4.0..9.0).contains(&slower), "{slower}");
}

/// Genghis comes: within 20 s red makes its last stroke at the right end. Genghis' strokes take twice as long, and red waits.
#[test]
fn when_another_robot_comes_each_keeps_to_its_end() {
    let all = events(&parker_box(&[kill(), add()]), Outcome::Complete);
    let of_genghis: Vec<Stroke> = strokes(&all)
        .into_iter()
        .filter(|it| it.robot == "genghis")
        .collect();
    assert!(of_genghis.len() > 3, "{of_genghis:?}");
    assert!(
        of_genghis.iter().all(|stroke| stroke.end == "right"),
        "{of_genghis:?}"
    );
    for stroke in strokes(&all).iter().filter(|it| it.at_s > ADDED_S + 20.0) {
        let own = if stroke.end == "left" {
            "red"
        } else {
            "genghis"
        };
        assert_eq!(stroke.robot, own, "{stroke:?}");
    }
}

/// Genghis babbles: it yields at ψ, 30 s after it activated, and red takes its end within a second of that.
#[test]
fn a_babbler_is_waited_for_until_it_yields() {
    let babble = (180.0, Fault::Babble("genghis".to_owned()));
    let mut scenario = parker_box(&[kill(), add(), babble]);
    scenario.limit_s = 260.0;
    let all = events(&scenario, Outcome::TimeLimit);
    let yielded = all
        .iter()
        .find(|event| event.robot == "genghis" && event.reason == "acquiesced-psi")
        .unwrap();
    let yielded_s = yielded.t_ms.as_secs_f64();
    let began = activations(&all, "genghis", "push(right)", 0.0);
    let began = began.into_iter().rfind(|at_s| *at_s < yielded_s).unwrap();
    assert!(
        (yielded_s - began - 30.0).abs() < 0.151,
        "{began} {yielded_s}"
    );
    let red = activations(&all, "red", "push(right)", 180.0);
    assert!(
        (0.0..1.0).contains(&(red[0] - yielded_s)),
        "{red:?} {yielded_s}"
    );
}

/// A bar that gives way to nobody: whoever pushes it gives up after λ, and goes on when it gives way again.
#[test]
fn a_stuck_bar_is_given_up_and_taken_up_again() {
    let stuck = MissionFault::new(BAR_STUCK, &[("stuck_s", 80.0)]);
    let scenario = parker_box(&[(20.0, Fault::Mission(stuck))]);
    let all = events(&scenario, Outcome::Complete);
    let stopped = |event: &&EventRow| event.kind == "slipped" && event.reason == "fixed";
    assert!(all.iter().any(|event| stopped(&event)));
    assert!(
        all.iter()
            .any(|event| event.reason.contains("lambda") || event.reason.contains("psi")),
        "nobody gives up"
    );
    let between = strokes(&all)
        .iter()
        .filter(|it| (20.5..99.9).contains(&it.at_s))
        .count();
    assert_eq!(between, 0);
    assert!(strokes(&all).iter().any(|stroke| stroke.at_s > 100.0));
}

/// Who does not see the bar takes no part: the other one does both ends.
#[test]
fn without_its_bar_sensor_a_robot_leaves_both_ends_to_the_other() {
    let text = "[[faults.timeline]]\nat_s = 30.0\nfault.sensor = { robot = 'blue', device = 'bar', mode = 'dead' }\n";
    let vocabulary = Registry::built_in().vocabulary();
    let faults = Scenario::parse(
        "f.toml",
        &format!("[push]\n[[push.bars]]\nx_m = 2\ny_m = 3\ngoal_x_m = 9\n{text}"),
        &vocabulary,
    );
    let mut scenario = parker_box(&[]);
    scenario.faults = faults.unwrap().faults;
    let all = strokes(&events(&scenario, Outcome::Complete));
    let later = || all.iter().filter(|it| it.at_s > 40.0);
    assert!(later().all(|stroke| stroke.robot == "red"));
    assert!(later().any(|stroke| stroke.end == "right"));
}

/// By processes, with a real SIGKILL, as in one; and again from its inputs.
#[test]
fn processes_write_the_bytes_of_one_process_and_a_replay() {
    let lab = Lab::new();
    let arguments = ["parker-box", "--limit", "90"];
    lab.mission("processes", &arguments).expect(1);
    lab.mission("one", &[&arguments[..], &["--in-process"]].concat())
        .expect(1);
    lab.assert_same_bytes("processes", "one");
    lab.run(&["replay", "processes"]).expect(0);
}

/// Six bars, a robot killed: all that must hold does in each tick, and every bar arrives.
#[test]
fn a_family_copes_with_a_death() {
    let mut scenario = family(12, 6);
    scenario.faults.timeline = vec![Order {
        at_s: Some(20.0),
        ..Order::now(Fault::Kill("r3".to_owned()))
    }];
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let mut invariants = Invariants::new(&setup);
    let mut team = Team::new(setup, LogLevel::Off, alliance_proto::log::Memory::default()).unwrap();
    let outcome = loop {
        let outcome = team.tick().unwrap();
        invariants.see(team.simulation()).unwrap();
        if let Some(outcome) = outcome {
            break outcome;
        }
    };
    assert_eq!(outcome, Outcome::Complete);
}
