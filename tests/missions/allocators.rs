//! Allocators without messages of their own: the same bytes by processes, in one process and in a replay, and the
//! takeover of a crashed robot's tasks as in docs/ALLOCATORS.md, "Under the same faults".

use alliance_tests::testkit::{KILL, RESTART};
use glam::Vec2;
use in_process::Team;
use missions::Registry;
use proto::tick::Outcome;
use run_log::{
    AllocationRow, EventRow, LogLevel, MemoryLog, MessageRow, MotivationRow, PoseRow, RunLog,
};
use scenario::ids::{RobotId, TaskId};
use scenario::mission::FigureValue;
use scenario::testkit::entry;
use scenario::{Scenario, Setup};

use crate::harness::Lab;
use crate::negotiation::{NEGOTIATORS, checked};

const BASELINES: [&str; 4] = ["nearest", "first-come", "random", "static"];

/// Allocators that send no messages and do not wait for teammates.
const INDEPENDENT: [&str; 3] = ["threshold", "nearest-silent", "oracle"];

pub fn scenario(allocator: &str, rest: &str) -> Scenario {
    let known = missions::Registry::built_in().vocabulary();
    let text = format!("allocator = \"{allocator}\"\nlimit_s = 1800.0\n{rest}");
    Scenario::parse("s.toml", &text, &known).unwrap()
}

fn run(scenario: Scenario, seed: u64) -> (Outcome, RunLog) {
    let setup = Setup::resolve(scenario, seed, None).unwrap().setup;
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (outcome, recorder) = team.run().unwrap();
    (
        outcome,
        RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap(),
    )
}

/// Returns the activations of a task after a time: time, robot and reason.
fn activations(log: &RunLog, task: &str, after_ms: u64) -> Vec<(u64, String, String)> {
    let rows = log.rows::<EventRow>().unwrap().into_iter();
    rows.filter(|row| row.kind == "activated" && row.subject == task && row.t_ms.0 >= after_ms)
        .map(|row| (row.t_ms.0, row.robot, row.reason))
        .collect()
}

#[test]
fn processes_and_one_process_write_the_same_bytes_and_replay_them() {
    let lab = Lab::new();
    std::fs::write(lab.path("kill.toml"), KILL).unwrap();
    let all = BASELINES.into_iter().chain(INDEPENDENT).chain(NEGOTIATORS);
    for allocator in all {
        let arguments = ["kill.toml", "--limit", "200", "--allocator", allocator];
        let many = lab.mission(&format!("{allocator}-many"), &arguments);
        let out = format!("{allocator}-one");
        let one = lab.run(&[&["run", "--in-process", "--out", &out], &arguments[..]].concat());
        assert_eq!(many.status.code(), one.status.code(), "{}", many.stderr);
        assert!(
            many.status.code().is_some_and(|code| code < 2),
            "{}",
            many.stderr
        );
        // These allocators have no motivations.csv.
        for file in [
            "allocation.csv",
            "events.csv",
            "poses.csv",
            "messages.csv",
            "ticks.csv",
        ] {
            let read = |run: &str| std::fs::read(lab.path(run).join(file)).unwrap();
            assert!(
                read(&format!("{allocator}-many")) == read(&out),
                "{allocator}: {file}"
            );
        }
        lab.run(&["replay", &format!("{allocator}-many")]).expect(0);
        let log = lab.log(&out);
        assert!(log.rows::<MotivationRow>().unwrap().is_empty());
        let rows = log.rows::<AllocationRow>().unwrap();
        assert!(rows.len() > 1000);
        // Each row is of one behavior. A task that the robot can do in two ways has two rows.
        let catalog = &log.run.setup.catalog;
        let of = |row: &AllocationRow| catalog.find_behavior(&row.behavior_set).unwrap();
        let task = |row: &AllocationRow| catalog.task_name(catalog.sets[of(row).index()].task);
        assert!(rows.iter().all(|row| task(row) == row.task));
        let first = rows
            .iter()
            .filter(|row| row.robot == "blue" && row.t_ms == rows[0].t_ms);
        let first: Vec<&str> = first.map(|row| row.behavior_set.as_str()).collect();
        assert_eq!(
            first,
            ["find-locations-methodical", "find-locations-wander"],
            "{allocator}"
        );
    }
}

#[test]
fn every_baseline_completes_the_mission() {
    for allocator in ["nearest", "first-come", "static"] {
        let (outcome, log) = run(scenario(allocator, ""), 1);
        assert_eq!(outcome, Outcome::Complete, "{allocator}");
        let delivered = log.run.result.mission.get("items.delivered");
        assert_eq!(delivered, FigureValue::Count(24), "{allocator}");
    }
}

/// Law G5: a robot with all skills completes alone. With `static` a robot does only its own assigned and known tasks,
/// and does not search.
#[test]
fn with_all_links_cut_all_allocators_but_static_complete() {
    const CUT: &str = "[[faults.timeline]]\nat_s = 0\n\
         fault.drop = { from = \"all\", to = \"all\", p = 1.0 }\n";
    for allocator in &Registry::built_in().vocabulary().allocators {
        let mut scenario = scenario(allocator.name, CUT);
        scenario.limit_s = 3600.0;
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
        let expected = match allocator.name {
            "static" => Outcome::TimeLimit,
            _ => Outcome::Complete,
        };
        assert_eq!(team.run().unwrap().0, expected, "{}", allocator.name);
    }
}

/// The task of a crashed robot becomes free after τ = 5 s of silence, not before.
#[test]
fn first_come_takes_over_after_tau() {
    let (outcome, log) = run(scenario("first-come", KILL), 1);
    assert_eq!(outcome, Outcome::Complete);
    let rows = log.rows::<EventRow>().unwrap();
    let last = rows
        .iter()
        .rfind(|row| row.kind == "activated" && row.robot == "gold")
        .unwrap();
    let received: Vec<u64> = log
        .each_row::<MessageRow>()
        .map(|row| row.unwrap())
        .filter(|row| {
            row.sender == "gold" && row.delivery == "received" && row.state == "executing"
        })
        .map(|row| row.t_ms.0)
        .collect();
    let silent_since = received.iter().max().unwrap();
    let next = activations(&log, &last.subject, 100_000);
    let (when, robot, reason) = next.first().unwrap();
    assert!(
        *when >= silent_since + 5000,
        "{robot} took it at {when} ms; last received heartbeat at {silent_since} ms"
    );
    assert_ne!(robot, "gold");
    assert_eq!(reason, "claimed");
}

/// Gold crashes at 100 s and restarts at 160 s. Its task is taken over after τ, and the new incarnation takes only
/// free tasks.
#[test]
fn first_come_gives_a_new_incarnation_only_free_tasks() {
    let (outcome, log, violation) = checked(scenario("first-come", RESTART));
    assert_eq!((outcome, violation), (Outcome::Complete, None));
    let rows = log.rows::<EventRow>().unwrap();
    let of_gold = |row: &&EventRow| row.robot == "gold" && row.kind == "activated";
    let last = rows
        .iter()
        .filter(of_gold)
        .rfind(|row| row.t_ms.0 <= 100_000);
    let taken = activations(&log, &last.unwrap().subject, 100_001);
    let (at, by, _) = &taken[0];
    assert!(
        by != "gold" && (104_000..=106_000).contains(at),
        "{taken:?}"
    );
    let first = rows.iter().filter(of_gold).find(|row| row.t_ms.0 > 100_000);
    let first = first.expect("gold works in its new incarnation");
    assert!((160_000..200_000).contains(&first.t_ms.0), "{first:?}");
    let outbid = rows
        .iter()
        .filter(|row| row.kind != "activated" && row.reason == "outbid");
    let lost: Vec<_> = outbid
        .filter(|row| row.robot != "gold" && row.t_ms.0 > 160_000)
        .collect();
    assert!(lost.is_empty(), "{lost:?}");
}

/// These allocators deliver all items under each fault, without an invariant violation and without allocation
/// messages.
#[test]
fn allocators_that_wait_for_no_teammate_complete_under_every_fault() {
    let cases = [
        "",
        KILL,
        RESTART,
        "[[faults.timeline]]\nat_s = 0.0\nfault.drop = { p = 0.6 }\n",
        "[[faults.timeline]]\nat_s = 120.0\nfor_s = 60.0\n\
         fault.partition = { groups = [[\"blue\"], [\"gold\", \"green\"]] }\n",
        "[[faults.timeline]]\nwhen = \"gold activates move-spill(top)\"\nfault.babble = \"gold\"\n",
        "robots = [{ name = \"blue\" }]\n",
    ];
    for allocator in INDEPENDENT {
        for faults in cases {
            let (outcome, log, violation) = checked(scenario(allocator, faults));
            assert_eq!(violation, None, "{allocator}: {faults}");
            assert_eq!(outcome, Outcome::Complete, "{allocator}: {faults}");
            let delivered = log.run.result.mission.get("items.delivered");
            assert_eq!(delivered, FigureValue::Count(24), "{allocator}: {faults}");
            let messages = log.each_row::<MessageRow>().map(|row| row.unwrap());
            assert_eq!(messages.filter(|row| row.kind == "allocation").count(), 0);
        }
    }
}

/// Returns the pose rows of a robot, step by step.
fn poses_of(log: &RunLog, robot: &str) -> Vec<PoseRow> {
    let rows = log.each_row::<PoseRow>().map(|row| row.unwrap());
    rows.filter(|row| row.robot == robot).collect()
}

/// A robot without radio acts the same with any behavior of a teammate that it does not meet.
///
/// Here this holds until it goes to report, because it does not receive that gold has reported. With a radio it does.
#[test]
fn a_robot_without_radio_acts_the_same_whatever_its_teammates_do() {
    let far_apart = |allocator: &str, gold: &str, rest: &str| {
        let text = format!(
            "limit_s = 200.0\n{rest}waste.border_known = true\n\
             [[robots]]\nname = \"blue\"\nallocator = \"{allocator}\"\n\
             start = {{ x_m = 9.0, y_m = 7.0 }}\ntasks = [\"move-spill(top)\", \"report-progress\"]\n\
             [[robots]]\nname = \"gold\"\nallocator = \"{gold}\"\ntasks = [\"report-progress\"]\n"
        );
        let known = Registry::built_in().vocabulary();
        run(Scenario::parse("s.toml", &text, &known).unwrap(), 1).1
    };
    let dead = "faults.timeline = [{ at_s = 0.0, fault.kill = \"gold\" }]\n";
    let alike = |allocator: &str, gold: &str| {
        let (with, without) = (
            far_apart(allocator, gold, ""),
            far_apart(allocator, gold, dead),
        );
        let at = |row: &PoseRow| Vec2::new(row.x_m, row.y_m);
        let met = |log: &RunLog| {
            let pairs = poses_of(log, "blue").into_iter().zip(poses_of(log, "gold"));
            let near = |(blue, gold): &(PoseRow, PoseRow)| at(blue).distance(at(gold)) < 2.0;
            pairs.take_while(|pair| !near(pair)).count()
        };
        let until = met(&with).min(met(&without));
        let (with_gold, alone) = (poses_of(&with, "blue"), poses_of(&without, "blue"));
        let goes_to_report = (alone[..until].iter())
            .any(|row| row.behavior_set == "report-progress" && row.t_ms.0 >= 121_000);
        assert!(goes_to_report, "{allocator}: until {until}");
        (with, with_gold[..until] == alone[..until])
    };
    for gold in ["nearest", "nearest-silent", "ble", "alliance"] {
        let (log, is_alike) = alike("nearest-silent", gold);
        assert!(is_alike, "{gold}");
        // The robot neither sends nor receives a message.
        let messages = log.each_row::<MessageRow>().map(|row| row.unwrap());
        assert_eq!(messages.count(), 0, "{gold}");
        let reports = log.rows::<EventRow>().unwrap();
        let mut reports = reports.iter().filter(|row| row.kind == "reported");
        assert!(
            reports.any(|row| row.robot == "gold" && row.t_ms.0 < 125_000),
            "{gold}"
        );
    }
    let (_, is_alike) = alike("nearest", "nearest");
    assert!(!is_alike);
}

/// The oracle counts a robot out in the step in which it can no longer work, and counts it in when it can work again.
#[test]
fn the_oracle_counts_only_robots_that_can_work() {
    for (fault, counts_once_more) in [("kill", true), ("babble", false), ("power", false)] {
        let faults =
            format!("[[faults.timeline]]\nat_s = 100.0\nfor_s = 60.0\nfault.{fault} = \"gold\"\n");
        let (outcome, log) = run(scenario("oracle", &faults), 1);
        assert_eq!(outcome, Outcome::Complete, "{fault}");
        let rows = log.rows::<AllocationRow>().unwrap();
        let held = |from_ms: u64, to_ms: u64| {
            let within = rows
                .iter()
                .filter(|row| (from_ms..to_ms).contains(&row.t_ms.0));
            within.filter(|row| row.holder == "gold").count()
        };
        let since_ms = 100_000 + if counts_once_more { 50 } else { 0 };
        assert!(held(99_000, since_ms) > 0, "{fault}");
        assert_eq!(held(since_ms, 160_000), 0, "{fault}");
        assert!(held(160_000, u64::MAX) > 0, "{fault}");
        // Robots finish the tasks that they have begun.
        let events = log.rows::<EventRow>().unwrap();
        let begun = events.iter().filter(|row| row.kind == "activated").count();
        assert!(begun < 60, "{fault}: {begun}");
        // No task has more active robots than it needs.
        let mut at: std::collections::BTreeMap<(u64, &str), u32> = Default::default();
        for row in rows.iter().filter(|row| row.state == "active") {
            *at.entry((row.t_ms.0, &row.task)).or_default() += 1;
        }
        assert!(at.values().all(|robots| *robots == 1), "{fault}");
    }
}

/// Only allocators that request the ground truth receive it, and it contains only tasks with work left.
#[test]
fn only_allocators_that_request_the_ground_truth_receive_it() {
    for (allocator, requests) in [("oracle", true), ("nearest", false), ("alliance", false)] {
        let setup = Setup::resolve(scenario(allocator, ""), 1, None)
            .unwrap()
            .setup;
        let (robots, tasks) = (
            setup.scenario.robots.len() as u16,
            setup.catalog.tasks.len() as u16,
        );
        let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
        let mut offers = 0;
        loop {
            let world = team.simulation().world();
            let pairs = (0..robots).flat_map(|robot| (0..tasks).map(move |task| (robot, task)));
            let pairs = pairs.map(|(robot, task)| (RobotId(robot), TaskId(task)));
            let is_due = |&(robot, task): &_| world.mission().has_work(task, robot, world);
            let due: Vec<(RobotId, TaskId)> = pairs.filter(is_due).collect();
            let outcome = team.tick().unwrap();
            for robot in (0..robots).map(RobotId) {
                for offer in &team.simulation().message(robot).ground_truth {
                    assert!(due.contains(&(offer.robot, offer.task)), "{offer:?}");
                    offers += 1;
                }
            }
            if outcome.is_some() {
                break;
            }
        }
        assert_eq!(offers > 0, requests, "{allocator}");
    }
}

#[test]
fn static_never_takes_over() {
    let (outcome, log) = run(scenario("static", KILL), 1);
    assert_eq!(outcome, Outcome::TimeLimit);
    let gold: Vec<String> = log
        .rows::<EventRow>()
        .unwrap()
        .into_iter()
        .filter(|row| row.kind == "activated" && row.robot == "gold" && row.t_ms.0 <= 100_000)
        .map(|row| row.subject)
        .collect();
    assert!(!gold.is_empty());
    for task in gold {
        assert_eq!(activations(&log, &task, 100_001), [], "{task}");
    }
}

#[test]
fn a_team_can_mix_allocators_and_the_command_line_overrides_them() {
    let lab = Lab::new();
    let mixed = "[[robots]]\nname = \"blue\"\nside_sensor = true\n\
                 [[robots]]\nname = \"gold\"\nallocator = \"nearest\"\n";
    std::fs::write(lab.path("mixed.toml"), mixed).unwrap();
    lab.mission("mixed", &["mixed.toml", "--limit", "60"])
        .expect(1);
    let log = lab.log("mixed");
    let weighed = log.rows::<AllocationRow>().unwrap();
    assert!(!weighed.is_empty() && weighed.iter().all(|row| row.robot == "gold"));
    let motivated = log.rows::<MotivationRow>().unwrap();
    assert!(!motivated.is_empty() && motivated.iter().all(|row| row.robot == "blue"));

    lab.mission(
        "all",
        &["mixed.toml", "--limit", "60", "--allocator", "static"],
    )
    .expect(1);
    assert!(lab.log("all").rows::<MotivationRow>().unwrap().is_empty());
}

#[test]
fn bad_allocator_input_gives_one_line_with_its_place() {
    let lab = Lab::new();
    let texts = [
        "allocator = \"nearst\"\n",
        "\n[allocators.random]\nredraws = 1.0\n",
        "[allocators.nearest]\nredraw_s = 1.0\n",
        "[allocators.random]\nredraw_s = -1.0\n",
    ];
    let answers = texts.map(|text| {
        std::fs::write(lab.path("s.toml"), text).unwrap();
        entry(text, &lab.refusal(&["run", "s.toml", "--out", "none"]))
    });
    let unknown = ["run", "--out", "none", "--allocator", "telepathy"];
    let unknown = entry(&unknown.join(" "), &lab.refusal(&unknown));
    insta::assert_snapshot!(answers.concat() + &unknown);
    assert!(!lab.path("none").exists());
}

#[test]
fn allocators_are_listed_with_their_parameters() {
    let lab = Lab::new();
    let all = lab.run(&["list", "allocators"]).expect(0).stdout;
    for name in BASELINES.iter().chain(&INDEPENDENT).chain(&["alliance"]) {
        assert!(all.lines().any(|line| line.starts_with(name)), "{all}");
    }
    let random = lab.run(&["list", "allocators", "random"]).expect(0).stdout;
    assert!(random.contains("redraw_s = 30 s"), "{random}");
    let threshold = lab
        .run(&["list", "allocators", "threshold"])
        .expect(0)
        .stdout;
    assert!(threshold.contains("theta_max = 1000"), "{threshold}");
    lab.run(&["list", "allocators", "telepathy"]).expect(2);
}
