//! Every allocator in whole missions: under faults, alone, in large teams and in each mission. `parity.rs` compares
//! processes with one process.

use std::collections::BTreeMap;

use alliance_tests::harness::Lab;
use alliance_tests::runs::{allocators, builtin, checked, parse, play, run, setup};
use alliance_tests::testkit::{KILL, PARTITION, RESTART, loss, loss_and_kill};
use missions::waste::data::family;
use proto::tick::Outcome;
use run_log::{AllocationRow, EventRow, LogLevel, MessageRow, MotivationRow, RunLog, Table};
use scenario::Scenario;
use scenario::testkit::entry;
use scenario::time::SimTime;

/// A step of the default mission.
const STEP: SimTime = SimTime(50);

/// The allocators whose robots do not work on a claimed task.
const CLAIMANTS: [&str; 7] = [
    "first-come",
    "cbaa",
    "cbba",
    "acbba",
    "grape",
    "ble",
    "murdoch",
];

/// A mission of service in which another robot can always take over.
const SERVICE: &str = include_str!("../../analysis/sweeps/allocators-service.toml");

/// Returns the default mission with additional lines.
pub fn scenario(allocator: &str, rest: &str) -> Scenario {
    parse(&format!(
        "allocator = \"{allocator}\"\nlimit_s = 1800.0\n{rest}"
    ))
}

/// Returns the mission of service with additional lines.
pub fn service(allocator: &str, rest: &str) -> Scenario {
    let plan: toml::Table = toml::from_str(SERVICE).unwrap();
    let mission = toml::to_string(&plan["scenario"]).unwrap();
    parse(&format!("allocator = \"{allocator}\"\n{rest}{mission}"))
}

/// The invariants hold in each tick, and all items are delivered. Only `static` never takes over from a lost robot.
#[test]
fn missions_complete_under_every_fault() {
    let cases = [
        KILL.to_owned(),
        RESTART.to_owned(),
        loss(0.6),
        PARTITION.to_owned(),
    ];
    for allocator in allocators() {
        for faults in &cases {
            let (outcome, _, violation) = checked(scenario(allocator, faults), LogLevel::Off);
            assert_eq!(violation, None, "{allocator}: {faults}");
            let expected = match allocator {
                "static" if faults == KILL => Outcome::TimeLimit,
                _ => Outcome::Complete,
            };
            assert_eq!(outcome, expected, "{allocator}: {faults}");
        }
    }
}

/// Law G5: a robot with all skills completes alone. With `static` a robot does only its own assigned and known tasks,
/// and does not search.
#[test]
fn with_all_links_cut_all_allocators_but_static_complete() {
    for allocator in allocators() {
        let mut scenario = scenario(allocator, &loss(1.0));
        scenario.limit_s = 3600.0;
        let expected = match allocator {
            "static" => Outcome::TimeLimit,
            _ => Outcome::Complete,
        };
        let (outcome, _) = run(setup(scenario, 1), LogLevel::Off);
        assert_eq!(outcome, expected, "{allocator}");
    }
}

/// Returns the time of the last message that is received from gold, of any kind or of one kind.
fn last_received(log: &RunLog, kind: &str) -> SimTime {
    let rows = log.each_row::<MessageRow>().map(|row| row.unwrap());
    let fits = |row: &MessageRow| row.sender == "gold" && row.delivery == "received";
    rows.filter(|row| fits(row) && (kind.is_empty() || row.kind == kind))
        .map(|row| row.t_ms)
        .max()
        .unwrap()
}

/// Another robot takes the task of a killed robot in the step that the rule of the allocator states.
#[test]
fn the_task_of_a_killed_robot_is_taken_over_in_the_stated_step() {
    let tau = SimTime(5000);
    for allocator in CLAIMANTS {
        let (outcome, log) = play(scenario(allocator, KILL), 1);
        assert_eq!(outcome, Outcome::Complete, "{allocator}");
        let events = log.rows::<EventRow>().unwrap();
        let killed = SimTime(100_000);
        let mut activations = events.iter().filter(|row| row.kind == "activated");
        let of_gold = |row: &&EventRow| row.robot == "gold" && row.t_ms <= killed;
        let task = &activations.clone().rfind(of_gold).unwrap().detail;
        let next = activations
            .find(|row| row.detail == *task && row.robot != "gold" && row.t_ms > killed)
            .unwrap();
        let (due, reason) = match allocator {
            "first-come" => (last_received(&log, "heartbeat") + tau, "claimed"),
            // A table row is valid for τ after its receipt.
            "ble" => (last_received(&log, "allocation") + tau, "claimed"),
            // A claim is valid for τ after it was sent, one step before its receipt.
            "cbaa" | "cbba" => (
                last_received(&log, "allocation").since(STEP) + tau,
                "claimed",
            ),
            // Any message is a sign of life.
            "acbba" | "grape" => (last_received(&log, "").since(STEP) + tau, "claimed"),
            // One step until the lease ends, half a second of bids, one step until the award is received.
            _ => (
                last_received(&log, "allocation") + SimTime(6000 + 500) + STEP + STEP,
                "awarded",
            ),
        };
        // Robots that wait for the end of a unit of work take over later.
        let is_in_time =
            next.t_ms == due || (["first-come", "grape"].contains(&allocator) && next.t_ms > due);
        assert!(is_in_time, "{allocator}: {next:?}, due at {due}");
        assert_eq!(next.reason, reason, "{allocator}");
    }
}

/// Both sides of a partition do all tasks. After it has healed, one robot keeps each task, as soon as it has put down
/// its load.
#[test]
fn a_healed_partition_has_no_duplicate_tasks() {
    for allocator in CLAIMANTS {
        let (_, log) = play(scenario(allocator, PARTITION), 1);
        let mut at: BTreeMap<(SimTime, String), u32> = BTreeMap::new();
        for row in log.each_row::<AllocationRow>().map(|row| row.unwrap()) {
            if row.state == "active" {
                *at.entry((row.t_ms, row.task)).or_default() += 1;
            }
        }
        let duplicate_s = |from_s: f64, to_s: f64| {
            let within = at
                .iter()
                .filter(|((t_ms, _), _)| (from_s..to_s).contains(&t_ms.as_secs_f64()));
            let surplus: u32 = within.map(|(_, count)| count - 1).sum();
            f64::from(surplus) * STEP.as_secs_f64()
        };
        let (during, after) = (duplicate_s(60.0, 120.0), duplicate_s(121.5, 3600.0));
        assert!(during > 10.0, "{allocator}: {during} s");
        let load_s = if allocator == "murdoch" { 20.0 } else { 0.0 };
        assert!(after <= 1.0 + load_s, "{allocator}: {after} s");
    }
}

#[test]
fn static_never_takes_over() {
    let (_, log) = play(scenario("static", KILL), 1);
    let events = log.rows::<EventRow>().unwrap();
    let activated = || events.iter().filter(|row| row.kind == "activated");
    let of_gold = activated().filter(|row| row.robot == "gold");
    let tasks: Vec<&str> = of_gold.map(|row| row.detail.as_str()).collect();
    assert!(!tasks.is_empty());
    let mut later = activated().filter(|row| row.t_ms.0 > 100_000);
    assert!(later.all(|row| !tasks.contains(&row.detail.as_str())));
}

#[test]
fn a_robot_without_radio_acts_the_same_with_all_links_cut() {
    let is_alike = |allocator: &str| {
        let [open, cut] = ["", loss(1.0).as_str()].map(|faults| {
            let scenario = scenario(allocator, faults);
            run(setup(scenario, 1), LogLevel::Full).1.into_sink()
        });
        open.tables[&Table::Poses] == cut.tables[&Table::Poses]
    };
    assert!(is_alike("nearest-silent"));
    assert!(!is_alike("nearest"));
}

/// The oracle counts a robot out in the step in which it can no longer work, and counts it in when it can work again.
#[test]
fn the_oracle_counts_only_robots_that_can_work() {
    for (fault, counts_once_more) in [("kill", true), ("babble", false), ("power", false)] {
        let faults =
            format!("[[faults.timeline]]\nat_s = 100.0\nfor_s = 60.0\nfault.{fault} = \"gold\"\n");
        let (outcome, log) = play(scenario("oracle", &faults), 1);
        assert_eq!(outcome, Outcome::Complete, "{fault}");
        let rows = log.rows::<AllocationRow>().unwrap();
        let held = |from_ms: u64, to_ms: u64| {
            let is_within = |row: &&AllocationRow| (from_ms..to_ms).contains(&row.t_ms.0);
            let within = rows.iter().filter(is_within);
            within.filter(|row| row.holder == "gold").count()
        };
        let since_ms = 100_000 + if counts_once_more { STEP.0 } else { 0 };
        assert!(held(99_000, since_ms) > 0, "{fault}");
        assert_eq!(held(since_ms, 160_000), 0, "{fault}");
        assert!(held(160_000, u64::MAX) > 0, "{fault}");
    }
}

/// The invariants hold in each tick of a large team with a crash and message loss, and items are delivered.
#[test]
fn thirty_robots_work_with_every_allocator() {
    for allocator in allocators() {
        let mut scenario = family(30, 20);
        scenario.allocator = Some(allocator.to_owned());
        scenario.limit_s = 200.0;
        scenario.faults.timeline = loss_and_kill("r1", 100.0);
        let (_, log, violation) = checked(scenario, LogLevel::Off);
        assert_eq!(violation, None, "{allocator}");
        let delivered = log.run.result.mission.get("items.delivered").count();
        assert!(delivered > 0, "{allocator}");
    }
}

#[test]
fn every_allocator_pushes_and_observes() {
    for allocator in allocators() {
        for (mission, victim) in [("parker-box", "blue"), ("cmommt-crowded", "gold")] {
            let mut scenario = builtin(mission);
            scenario.allocator = Some(allocator.to_owned());
            scenario.limit_s = scenario.limit_s.min(120.0);
            scenario.faults.timeline = loss_and_kill(victim, 30.0);
            let (_, log, violation) = checked(scenario, LogLevel::Off);
            assert_eq!(violation, None, "{mission} by {allocator}");
            let worked = match mission {
                "parker-box" => log.run.result.mission.get("strokes").count() > 0,
                _ => log.run.result.mission.get("a").number().unwrap() > 0.0,
            };
            assert!(worked, "{mission} by {allocator}");
        }
    }
}

#[test]
fn the_service_work_of_a_crashed_robot_is_done() {
    let kill = "faults.timeline = [{ fault.kill = \"gold\", when = \"gold finishes\" }]\n";
    // `threshold` leaves its tasks so often that the test would take long.
    for allocator in allocators().filter(|name| *name != "threshold") {
        let (outcome, log, violation) = checked(service(allocator, kill), LogLevel::Off);
        assert_eq!(violation, None, "{allocator}");
        let expected = match allocator {
            "static" => Outcome::TimeLimit,
            _ => Outcome::Complete,
        };
        assert_eq!(outcome, expected, "{allocator}");
        let done = log.run.result.mission.get("done").count();
        assert_eq!(done == 24, allocator != "static", "{allocator}: {done}");
    }
}

#[test]
fn a_team_can_mix_allocators_and_the_command_line_overrides_them() {
    let lab = Lab::new();
    let mixed = "limit_s = 60\n[[robots]]\nname = \"blue\"\nside_sensor = true\n\
                 [[robots]]\nname = \"gold\"\nallocator = \"nearest\"\n";
    std::fs::write(lab.path("mixed.toml"), mixed).unwrap();
    lab.mission("mixed", &["mixed.toml"]).expect(1);
    let log = lab.log("mixed");
    let weighed = log.rows::<AllocationRow>().unwrap();
    assert!(!weighed.is_empty() && weighed.iter().all(|row| row.robot == "gold"));
    let motivated = log.rows::<MotivationRow>().unwrap();
    assert!(!motivated.is_empty() && motivated.iter().all(|row| row.robot == "blue"));

    lab.mission("all", &["mixed.toml", "--allocator", "static"])
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
    let listed = |name: &str| lab.run(&["list", "allocators", name]).expect(0).stdout;
    let all = lab.run(&["list", "allocators"]).expect(0).stdout;
    for name in allocators() {
        assert!(all.lines().any(|line| line.starts_with(name)), "{all}");
    }
    assert!(listed("random").contains("redraw_s = 30 s"));
    assert!(listed("threshold").contains("theta_max = 1000"));
    lab.run(&["list", "allocators", "telepathy"]).expect(2);
}
