//! The service mission as in docs/missions/service.md, from the logs of whole runs.

use std::collections::{BTreeMap, BTreeSet};

use alliance_tests::runs::{builtin, parse, play};
use missions::service::data::ServiceSection;
use proto::tick::Outcome;
use run_log::{EventRow, MessageRow, MotivationRow};
use scenario::Scenario;
use scenario::fault::{Fault, Order};

/// The robots with the skill for each kind of work in `janitorial`.
const ABLE: [(&str, [&str; 2]); 3] = [
    ("garbage", ["gold", "green"]),
    ("dust", ["gold", "blue"]),
    ("floor", ["blue", "green"]),
];

fn janitorial() -> Scenario {
    builtin("janitorial")
}

fn kind_of(scenario: &Scenario, point: &str) -> String {
    let section = ServiceSection::of(scenario);
    let number: usize = point.trim_start_matches('p').parse().unwrap();
    let kind = section.kinds_of_points().nth(number).unwrap();
    section.kinds[kind].name.clone()
}

fn events(scenario: &Scenario, expected: Outcome) -> Vec<EventRow> {
    let (outcome, log) = play(scenario.clone(), 1);
    assert_eq!(outcome, expected);
    log.rows().unwrap()
}

/// Checks that each point is done in its period by a robot with the skill, and that no robot begins other work.
fn check(scenario: &Scenario, events: &[EventRow]) {
    let mut open = BTreeSet::new();
    let mut done = BTreeMap::new();
    for event in events {
        let point = event.subject.as_str();
        match event.kind.as_str() {
            "arrived" => assert!(open.insert(point), "{point} arrives once a period"),
            "begun" | "done" => {
                let kind = kind_of(scenario, point);
                let able = ABLE.iter().find(|(name, _)| *name == kind).unwrap().1;
                assert!(able.contains(&event.robot.as_str()), "{event:?}");
                if event.kind == "done" {
                    assert!(open.remove(point), "{event:?}: the point must be open");
                    *done.entry(kind).or_insert(0) += 1;
                }
            }
            "expired" => panic!("{event:?}: the point must be done in its period"),
            _ => {}
        }
    }
    assert!(open.is_empty(), "{open:?} are not done");
    // 1,200 s contain 3 points each 150 s, 4 each 200 s, and 2 each 300 s.
    let expected = [("dust", 24), ("floor", 8), ("garbage", 24)];
    let expected = expected.map(|(kind, count)| (kind.to_owned(), count));
    assert_eq!(done, BTreeMap::from(expected));
}

#[test]
fn robots_with_the_skill_do_the_work_of_every_period_after_any_crash() {
    let scenario = janitorial();
    check(&scenario, &events(&scenario, Outcome::Complete));
    for victim in ["gold", "blue", "green"] {
        let mut scenario = janitorial();
        scenario.faults.timeline.push(Order {
            at_s: Some(300.0),
            ..Order::now(Fault::Kill(victim.to_owned()))
        });
        let events = events(&scenario, Outcome::Complete);
        check(&scenario, &events);
        let late = events
            .iter()
            .filter(|event| event.t_ms.as_secs_f64() > 300.1);
        let late: BTreeSet<&str> = late
            .filter(|event| event.kind == "begun")
            .map(|event| event.robot.as_str())
            .collect();
        assert_eq!(late.len(), 2, "{late:?} work after the crash of {victim}");
        assert!(!late.contains(victim));
    }
}

/// The takeover time to the step, from the log alone: ALLIANCE.md §4 from the last received message of the crashed
/// robot, or from the end of the successor's work.
#[test]
fn takeovers_occur_at_the_time_of_the_closed_form() {
    // Each victim is killed during a task. The three successors wait for the task, almost finish another task, or
    // have another long task.
    let cases = [
        ("gold", 160.0, "serve(garbage)", "green"),
        ("blue", 210.0, "serve(dust)", "gold"),
        ("green", 460.0, "serve(garbage)", "gold"),
    ];
    for (victim, at_s, task, successor) in cases {
        let mut scenario = janitorial();
        scenario.limit_s = 560.0;
        scenario.faults.timeline.push(Order {
            at_s: Some(at_s),
            ..Order::now(Fault::Kill(victim.to_owned()))
        });
        let step_s = scenario.step_ms as f64 / 1000.0;
        let (outcome, log) = play(scenario, 1);
        assert_eq!(outcome, Outcome::TimeLimit);
        let alliance = &log.run.setup.alliance;
        let (params, threshold) = (&alliance.robots[successor].sets[task], alliance.threshold);

        let messages: Vec<MessageRow> = log.rows().unwrap();
        let last = messages.iter().rfind(|row| {
            (row.receiver.as_str(), row.sender.as_str()) == (successor, victim)
                && row.delivery == "received"
        });
        let last = last.unwrap();
        assert_eq!(
            (last.state.as_str(), last.task.as_str()),
            ("executing", task)
        );
        let received_s = last.t_ms.as_secs_f64();
        assert!(
            (at_s - 1.1..=at_s + 0.1).contains(&received_s),
            "{received_s}"
        );

        let rows: Vec<MotivationRow> = log.rows().unwrap();
        let of_task = rows
            .iter()
            .filter(|row| row.robot == successor && row.behavior_set == task);
        let of_task: Vec<(f64, f64, &str)> = of_task
            .map(|row| (row.t_ms.as_secs_f64(), row.motivation, row.state.as_str()))
            .collect();
        let after = of_task.iter().filter(|(t_s, ..)| *t_s > received_s);
        let taken_s = after
            .clone()
            .find(|(.., state)| *state == "active")
            .unwrap()
            .0;
        let before = of_task.iter().filter(|(t_s, ..)| *t_s < taken_s);
        let at_rest = before
            .clone()
            .rfind(|(_, motivation, _)| *motivation == 0.0);
        let at_last = before.clone().rfind(|(t_s, ..)| *t_s <= received_s);
        let begins = [at_rest, at_last].into_iter().flatten();
        let (from_s, motivation, _) = *begins.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();

        let ceased_s = received_s + params.ceased_after_s;
        let slowly_s = (ceased_s - from_s).max(0.0);
        let left = threshold - motivation - slowly_s * params.slow_impatience[victim];
        let expected_s = ceased_s.max(from_s) + left.max(0.0) / params.fast_impatience;
        assert!(
            (taken_s - expected_s).abs() <= step_s + 1e-9,
            "{successor} takes {task} over from {victim} at {taken_s} s instead of {expected_s} s"
        );
    }
}

/// Two robots, each with a better skill for one of two kinds. Both kinds return each minute.
const TWO_AND_TWO: &str = "allocator = 'l-alliance'\nlimit_s = 2000\n\
    [service]\ntasks = 'kinds'\nreach_m = 1000\nduration_s = 1800\n\
    kinds = [{ name = 'dust', work_s = { min = 10, max = 10 }, period_s = 60 }, \
    { name = 'floor', work_s = { min = 10, max = 10 }, period_s = 60 }]\n\
    points = [{ kind = 'dust', x_m = 4, y_m = 4 }, { kind = 'floor', x_m = 8, y_m = 4 }]\n\
    [[robots]]\nname = 'gold'\nskills = { dust = 1.0, floor = 0.7 }\n\
    [[robots]]\nname = 'blue'\nskills = { dust = 0.7, floor = 1.0 }\n\
    [faults]\ntimeline = [{ fault.skill = { robot = 'gold', skill = 'floor', share = 0.4 }, at_s = 600, for_s = 900 }]\n";

/// L-ALLIANCE: a robot with a degraded skill gives up the task after its former duration, and the other robot
/// finishes it, until the fault ends. The robot does not stop to begin the task (docs/missions/service.md).
#[test]
fn with_l_alliance_a_degraded_robot_yields_to_the_other_robot() {
    let events = events(&parse(TWO_AND_TWO), Outcome::Complete);
    let floor = events.iter().filter(|event| event.subject == "p1");
    let done = floor.filter(|event| event.kind == "done");
    let done: Vec<(u64, &str)> = done
        .map(|event| (event.t_ms.0 / 1000, event.robot.as_str()))
        .collect();
    // From the fifth minute on all robots have learned all durations.
    let by = |from_s: u64, to_s: u64| {
        let within = done
            .iter()
            .filter(|(at_s, _)| (from_s..to_s).contains(at_s));
        let robots: Vec<&str> = within.map(|(_, robot)| *robot).collect();
        robots
    };
    assert_eq!(by(300, 600), ["gold"; 5]);
    assert_eq!(by(600, 1500), ["blue"; 15]);
    assert_eq!(by(1500, 1860), ["gold"; 5]);
    let yields = events.iter().filter(|event| {
        let is_floor = event.robot == "gold" && event.subject == "serve(floor)";
        is_floor && event.kind == "hibernated" && event.reason == "acquiesced-psi"
    });
    let yields: Vec<u64> = yields.map(|event| event.t_ms.0 / 1000).collect();
    assert!(
        yields.iter().all(|at_s| (600..1500).contains(at_s)),
        "{yields:?}"
    );
    assert_eq!(yields.len(), 15);
}

/// Gold is idle at the very place where blue has to work, in the open or in a corner. It moves away, even without a
/// radio.
#[test]
fn an_idle_robot_makes_way() {
    for (x_m, y_m) in [(6.0, 4.5), (0.25, 0.25)] {
        for allocator in ["nearest", "nearest-silent", "alliance"] {
            let text = format!(
                "name = 'way'\nlimit_s = 120.0\nallocator = '{allocator}'\n\
                 [[robots]]\nname = 'gold'\nskills = {{ dust = 1, garbage = 0 }}\n\
                 start = {{ x_m = {x_m}, y_m = {y_m}, heading_deg = 0 }}\n\
                 [[robots]]\nname = 'blue'\nskills = {{ dust = 0, garbage = 1 }}\n\
                 start = {{ x_m = 3, y_m = 2, heading_deg = 0 }}\n\
                 [[service.kinds]]\nname = 'dust'\nwork_s = {{ min = 2, max = 2 }}\n\
                 [[service.kinds]]\nname = 'garbage'\nwork_s = {{ min = 2, max = 2 }}\n\
                 [[service.points]]\nkind = 'dust'\nx_m = {x_m}\ny_m = {y_m}\n\
                 [[service.points]]\nkind = 'garbage'\nx_m = {x_m}\ny_m = {y_m}\n"
            );
            let events = events(&parse(&text), Outcome::Complete);
            let done: Vec<_> = events.iter().filter(|event| event.kind == "done").collect();
            assert_eq!(done.len(), 2, "{allocator} at {x_m}, {y_m}");
        }
    }
}
