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
        let is_late = |event: &&EventRow| event.t_ms.as_secs_f64() > 300.1;
        let begun = events.iter().filter(|event| event.kind == "begun");
        let late = begun.filter(is_late).map(|event| event.robot.as_str());
        let workers: BTreeSet<&str> = late.collect();
        assert_eq!(workers.len(), 2, "{workers:?} after the crash of {victim}");
        assert!(!workers.contains(victim));
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

        let mut messages: Vec<MessageRow> = log.rows().unwrap();
        messages.retain(|row| row.receiver == successor && row.sender == victim);
        let last = messages.iter().rfind(|row| row.delivery == "received");
        let last = last.unwrap();
        assert_eq!([&last.state, &last.task], ["executing", task]);
        let received_s = last.t_ms.as_secs_f64();
        let likely = at_s - 1.1..=at_s + 0.1;
        assert!(likely.contains(&received_s), "{received_s}");

        let mut rows: Vec<MotivationRow> = log.rows().unwrap();
        rows.retain(|row| row.robot == successor && row.behavior_set == task);
        let of_task = rows
            .iter()
            .map(|row| (row.t_ms.as_secs_f64(), row.motivation, row.state.as_str()));
        let of_task: Vec<(f64, f64, &str)> = of_task.collect();
        let mut after = of_task.iter().filter(|(t_s, ..)| *t_s > received_s);
        let taken = after.find(|(.., state)| *state == "active");
        let taken_s = taken.unwrap().0;
        let before = of_task.iter().filter(|(t_s, ..)| *t_s < taken_s);
        let mut at_rest = before.clone();
        let at_rest = at_rest.rfind(|(_, motivation, _)| *motivation == 0.0);
        let at_last = before.clone().rfind(|(t_s, ..)| *t_s <= received_s);
        let begins = [at_rest, at_last].into_iter().flatten();
        let (from_s, motivation, _) = *begins.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();

        let ceased_s = received_s + params.ceased_after_s;
        let slowly_s = (ceased_s - from_s).max(0.0);
        let left = threshold - motivation - slowly_s * params.slow_impatience[victim];
        let expected_s = ceased_s.max(from_s) + left.max(0.0) / params.fast_impatience;
        let is_on_time = (taken_s - expected_s).abs() <= step_s + 1e-9;
        assert!(is_on_time, "{successor}: {taken_s}, not {expected_s} s");
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
    let done: Vec<_> = done
        .map(|event| (event.t_ms.0 / 1000, event.robot.as_str()))
        .collect();
    // From the fifth minute on all robots have learned all durations.
    for (period_s, robot, count) in [
        (300..600, "gold", 5),
        (600..1500, "blue", 15),
        (1500..1860, "gold", 5),
    ] {
        let within = done.iter().filter(|(at_s, _)| period_s.contains(at_s));
        let robots: Vec<&str> = within.map(|(_, robot)| *robot).collect();
        assert_eq!(robots, vec![robot; count], "{period_s:?}");
    }
    let mut yields = events;
    yields.retain(|event| event.robot == "gold" && event.subject == "serve(floor)");
    yields.retain(|event| event.kind == "hibernated" && event.reason == "acquiesced-psi");
    let mut times_s = yields.iter().map(|event| event.t_ms.0 / 1000);
    assert!(
        times_s.all(|at_s| (600..1500).contains(&at_s)),
        "{yields:?}"
    );
    assert_eq!(yields.len(), 15);
}

/// Gold is idle at the very place where blue has to work, in the open or in a corner. It moves away, even without a
/// radio.
#[test]
fn an_idle_robot_makes_way() {
    for place in ["x_m = 6.0, y_m = 4.5", "x_m = 0.25, y_m = 0.25"] {
        for allocator in ["nearest", "nearest-silent", "alliance"] {
            let text = format!(
                "name = 'way'\nlimit_s = 120.0\nallocator = '{allocator}'\n\
                 [[robots]]\nname = 'gold'\nskills = {{ dust = 1, garbage = 0 }}\n\
                 start = {{ {place}, heading_deg = 0 }}\n\
                 [[robots]]\nname = 'blue'\nskills = {{ dust = 0, garbage = 1 }}\n\
                 start = {{ x_m = 3, y_m = 2, heading_deg = 0 }}\n\
                 [service]\nkinds = [{{ name = 'dust', work_s = {{ min = 2, max = 2 }} }}, \
                 {{ name = 'garbage', work_s = {{ min = 2, max = 2 }} }}]\n\
                 points = [{{ kind = 'dust', {place} }}, {{ kind = 'garbage', {place} }}]\n"
            );
            let events = events(&parse(&text), Outcome::Complete);
            let done = events.iter().filter(|event| event.kind == "done");
            assert_eq!(done.count(), 2, "{allocator} at {place}");
        }
    }
}

/// A robot that waits at a point ends the work in a window that is exactly as long, also by its own attempt and in a
/// crew. Steps of 50 ms are no binary fractions.
#[test]
fn a_window_as_long_as_its_work_suffices() {
    for (work_s, kind, point) in [
        (1, "", ""),
        (3, "", ""),
        (4, "", ""),
        (5, "", ""),
        (4, "kept = false", ""),
        (4, "", ", needs = { t = 2 }"),
    ] {
        let scenario = |window_s: f64| {
            parse(&format!(
                "limit_s = 90\nroom = {{ width_m = 8, height_m = 8 }}\nallocator = 'nearest'\n\
                 [service]\npoints = [{{ kind = 't', x_m = 4, y_m = 4, opens_s = 30, deadline_s = {}{point} }}]\n\
                 [[service.kinds]]\nname = 't'\nwork_s = {{ min = {work_s}, max = {work_s} }}\n{kind}\n\
                 [[robots]]\nname = 'a'\nstart = {{ x_m = 4, y_m = 3.7 }}\n\
                 [[robots]]\nname = 'b'\nstart = {{ x_m = 4, y_m = 4.3 }}\n",
                30.0 + window_s
            ))
        };
        let work_s = f64::from(work_s);
        events(&scenario(work_s), Outcome::Complete);
        events(&scenario(work_s - 0.1), Outcome::Expired);
    }
}
