//! `alliance run --in-process` writes the same bytes as many processes, with any faults.
//!
//! A normal test covers a part. `ALLIANCE_PARITY=all` runs every built-in scenario with ten seeds and a hundred
//! random fault timelines.

use std::collections::BTreeSet;

use alliance_tests::harness::{Arguments, Lab, join};
use alliance_tests::runs::{allocators, builtin, parse, vocabulary};
use alliance_tests::testkit::loss_and_kill;
use analysis::random_mission::faults::{RandomFaults, timeline};
use proto::tick::Outcome;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{RunFile, RunOutcome};

#[path = "../../in-process/tests/service_laws/instances.rs"]
mod instances;

/// Returns `all` if the environment requests the full test, otherwise `some`.
fn amount(all: u64, some: u64) -> u64 {
    match std::env::var("ALLIANCE_PARITY") {
        Ok(value) if value == "all" => all,
        _ => some,
    }
}

/// Runs a scenario by processes and in one process, compares them, and returns run.json.
#[track_caller]
fn check(lab: &Lab, arguments: impl Arguments) -> RunFile {
    let arguments = arguments.words();
    let many = lab.mission("many", &arguments);
    let status = many.status.code();
    let is_over = matches!(status, Some(0 | 1));
    assert!(is_over, "{arguments:?}: {}", many.stderr);
    let one = lab.run(join("run --in-process --out one", &arguments));
    assert_eq!(one.status.code(), status, "{arguments:?}: {}", one.stderr);
    lab.assert_same_bytes("many", "one");
    let run = |out: &str| lab.text(&format!("{out}/run.json"));
    assert_eq!(run("many"), run("one"), "{arguments:?}");
    let run = lab.log("one").run;
    assert!(run.hash.is_some() && !run.unscripted, "{arguments:?}");
    run
}

#[test]
fn every_built_in_scenario_has_the_same_bytes() {
    let vocabulary = vocabulary();
    for name in vocabulary.builtins().map(|builtin| builtin.name) {
        let scenario = builtin(name);
        // A large team shows all effects long before its end. One mission runs to its end.
        let limit = match scenario.robots.len() {
            _ if name == "waste-cleanup" => scenario.limit_s,
            0..=10 => scenario.limit_s.min(amount(10_000, 60) as f64),
            _ => 15.0,
        };
        for seed in 1..=amount(10, 1) {
            // Every table, of a team of many behavior sets, too.
            let arguments = format!("{name} --seed {seed} --limit {limit} --log full");
            check(&Lab::new(), arguments);
        }
    }
    // Each robot of this team has only some teammates in radio range.
    check(&Lab::new(), "--robots 22 --spills 15 --limit 15");
}

/// Each allocator has one of the missions, with message loss, a real SIGKILL and a restart. A replay is identical.
#[test]
fn every_allocator_has_the_same_bytes() {
    let missions = vocabulary().missions;
    for (allocator, mission) in allocators().zip(missions.iter().cycle()) {
        let mut scenario = mission.family(4, 3).unwrap();
        scenario.allocator = Some(allocator.to_owned());
        scenario.limit_s = 30.0;
        scenario.faults.timeline = loss_and_kill(&scenario.robots[1].name, 3.0);
        scenario.faults.timeline[1].for_s = Some(8.0);
        let lab = Lab::new();
        lab.write("s.toml", scenario.to_toml().unwrap());
        let run = check(&lab, "s.toml");
        assert_eq!(run.faults[1].hits, 1, "{allocator}: {:?}", run.faults);
        lab.assert_repeated("many");
    }
}

/// The processes start in waves, and all take part from the first tick on.
#[test]
fn a_team_that_starts_in_waves_has_the_same_bytes() {
    let lab = Lab::new();
    let run = check(&lab, "--robots 70 --limit 2 --log full");
    assert_eq!(run.result.ticks, 40);
    assert!(
        run.result
            .robots
            .values()
            .all(|robot| robot.ticks_counted == 40)
    );
    let many = lab.mission("again", "--robots 70 --limit 0.1").expect(1);
    let line = "the last 6 processes start when earlier ones have joined";
    assert!(many.stderr.contains(line), "{}", many.stderr);
}

/// A large team is stepped on several threads, and another thread writes its log.
#[test]
fn any_number_of_threads_has_the_same_bytes() {
    let lab = Lab::new();
    let run = |jobs: u32| {
        let words = format!("run --in-process --robots 700 --limit 3 --log full --jobs {jobs}");
        lab.run(format!("{words} --out jobs-{jobs}")).expect(1);
    };
    run(1);
    for jobs in [2, 5] {
        run(jobs);
        lab.assert_same_bytes("jobs-1", &format!("jobs-{jobs}"));
    }
}

/// A scenario of the mission service with all properties of points, chargers, loads and costs by path.
const ALL_PROPERTIES: &str = "
name = 'all-properties'
limit_s = 90
room = { width_m = 8, height_m = 6 }
energy = { capacity_j = 900, idle_w = 4, drive_w = 16 }
obstacles = [{ x_m = 3.9, y_m = 0, width_m = 0.2, height_m = 4 }]
[service]
costs = 'path'
reach_m = 0.5
reserve = 0.4
coalition_wait_s = 12
kinds = [{ name = 'a', work_s = { min = 2, max = 4 } }]
points = [
    { kind = 'a', x_m = 2, y_m = 1, name = 'first', opens_s = 10, deadline_s = 60, value = 5 },
    { kind = 'a', x_m = 6, y_m = 1, after = ['first'], priority = 2 },
    { kind = 'a', x_m = 6, y_m = 3, needs = { a = 1, arm = 1 } },
    { kind = 'a', x_m = 2, y_m = 3, deliver_to = [7, 5], demand = 2 },
    { kind = 'a', x_m = 5, y_m = 5, demand = 3 },
    { kind = 'a', x_m = 1, y_m = 5, demand = 2 },
]
chargers = [{ x_m = 1, y_m = 2, rate_w = 80 }]
[[robots]]
name = 'r1'
capacity = 5
skills = { a = 1, arm = 1 }
[[robots]]
name = 'r2'
skills = { a = 1 }
[[robots]]
name = 'r3'
capacity = 4
skills = { a = 0.5, arm = 1 }
";

#[test]
fn all_properties_of_points_have_the_same_bytes() {
    for allocator in ["alliance", "murdoch", "cbba", "grape"] {
        let mut scenario = parse(ALL_PROPERTIES);
        scenario.allocator = Some(allocator.to_owned());
        scenario.faults.timeline = loss_and_kill("r1", 15.0);
        scenario.faults.timeline[1].for_s = Some(8.0);
        let lab = Lab::new();
        lab.write("s.toml", scenario.to_toml().unwrap());
        let run = check(&lab, "s.toml --log full");
        let done = run.result.mission.get("done").count();
        assert!(done >= 3, "{allocator}: {:?}", run.result.mission);
        lab.assert_repeated("many");
    }
}

/// A random instance with points of some class, as a scenario file: a function of its number.
type Instance = fn(u64, &mut ChaCha8Rng) -> String;

const CLASSES: [Instance; 9] = [
    instances::windows_and_values,
    instances::precedence,
    instances::coalitions,
    instances::gatherings,
    instances::endurance,
    instances::deliveries,
    instances::loads,
    instances::paths,
    instances::lone,
];

/// The allocators take turns, and every second instance has faults. `--check` finds no violation, and its replay is
/// identical.
#[test]
fn random_instances_of_each_class_have_the_same_bytes() {
    let count = amount(100, 2);
    for (instance, class) in CLASSES.into_iter().zip(0..) {
        for number in class * count..(class + 1) * count {
            let mut chance = ChaCha8Rng::seed_from_u64(number);
            let mut text = instance(number, &mut chance);
            // The faults are those of a team of two or more.
            if number % 2 == 1 && text.contains("'r1'") {
                text += &instances::faults(&mut chance);
            }
            let lab = Lab::new();
            lab.write("s.toml", &text);
            check(&lab, "s.toml --log full --limit 200");
            let checked = lab.run("run s.toml --in-process --check --limit 200 --out checked");
            let stderr = &checked.stderr;
            assert!(!stderr.contains("violated"), "{number}: {stderr}\n{text}");
        }
    }
}

/// The default mission in a room with negative coordinates, and points of work in a room of 100 km.
const FRAMES: [&str; 2] = [
    "
name = 'moved'
room = { x_m = -64, y_m = 32, width_m = 12, height_m = 9 }
obstacles = [{ x_m = -58, y_m = 34, width_m = 1, height_m = 1 }]
",
    "
name = 'far'
limit_s = 12000
step_ms = 500
room = { x_m = -50000, y_m = -50000, width_m = 100000, height_m = 100000 }
body = { speed_m_s = 30, push_m_s = 30, turn_deg_s = 360 }
obstacles = [{ x_m = 20000, y_m = 0, width_m = 5, height_m = 30000 }]
robots = [
    { name = 'r1', start = { x_m = -5000, y_m = 0 } },
    { name = 'r2', start = { x_m = 40000, y_m = -40000 } },
]
[service]
costs = 'path'
reach_m = 30
kinds = [{ name = 'a', work_s = { min = 20, max = 40 } }]
points = [
    { kind = 'a', x_m = -49000, y_m = 49000 },
    { kind = 'a', x_m = -20000, y_m = 0 },
    { kind = 'a', x_m = 49000, y_m = -49000, deliver_to = [0, 0] },
]
",
];

#[test]
fn rooms_with_an_origin_have_the_same_bytes() {
    for text in FRAMES {
        let lab = Lab::new();
        lab.write("s.toml", parse(text).to_toml().unwrap());
        let run = check(&lab, "s.toml --log full");
        assert_eq!(run.outcome, RunOutcome::Ended(Outcome::Complete), "{text}");
        lab.assert_repeated("many");
        lab.run("export many --svg end --out pictures").expect(0);
        assert_eq!(lab.names("pictures").len(), 1, "{text}");
    }
}

#[test]
fn random_fault_timelines_have_the_same_bytes() {
    let days = amount(100, 5);
    let mut hit = BTreeSet::new();
    for day in 0..days {
        let mut scenario = builtin("waste-cleanup");
        let faults = RandomFaults {
            min: 3,
            max: 10,
            until_s: 110.0,
        };
        let mut rng = ChaCha8Rng::seed_from_u64(day);
        scenario.faults.timeline = timeline(&faults, &scenario, &mut rng);
        let lab = Lab::new();
        lab.write("day.toml", scenario.to_toml().unwrap());
        let order = ["simultaneous", "in-order"][day as usize % 2];
        let arguments = format!("day.toml --limit 120 --seed {day} --step-order {order}");
        let run = check(&lab, arguments);
        let effective = run.faults.iter().filter(|fault| fault.hits > 0);
        hit.extend(effective.map(|fault| fault.order.fault.name().to_owned()));
    }
    // Faults without an effect would test nothing.
    let expected = if days < 100 { 5 } else { 13 };
    assert!(hit.len() >= expected, "only {hit:?} had an effect");
    println!("{days} days, hit: {hit:?}");
}

/// In about half of the attempts the world reaches the second tick before the launcher is on the bus, and has to
/// repeat its request.
#[test]
fn a_restart_in_the_second_tick_has_the_same_bytes() {
    let early = "name = \"early\"\n[[faults.timeline]]\nfault.restart = 'blue'\nat_s = 0.05\n";
    for attempt in 0..4 {
        let lab = Lab::new();
        lab.write("early.toml", early);
        let run = check(&lab, "early.toml --limit 5");
        assert_eq!(run.faults[0].hits, 1, "attempt {attempt}");
    }
}

#[test]
fn options_that_need_processes_are_refused_in_one_line() {
    let lab = Lab::new();
    for option in ["--speed 5x", "--open", "--paused", "--stall-after 3"] {
        let refused = lab.refusal(format!("run --in-process {option}"));
        let start = "alliance: the argument '--in-process' cannot be used with";
        assert!(refused.starts_with(start), "{refused}");
    }
    assert!(!lab.exists("runs"));
}
