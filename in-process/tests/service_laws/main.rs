//! The laws of service with task properties, for every allocator on random instances.
//!
//! - `instances`: the instances of each class. `laws`: the laws, from the log of a run.
//! - `frames`: rooms with an origin, and rooms of 100 km. `starve`: places that must not keep robots from the rest.
//! - `together`: points that need several robots at once.

#![allow(clippy::unwrap_used)] // Clippy exempts test functions only, not their helpers.

mod frames;
mod instances;
mod laws;
mod starve;
mod together;

use in_process::Team;
use missions::Registry;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{EventRow, LogLevel, MemoryLog, RunLog};
use scenario::{Scenario, Setup};

/// The number of instances of each class, with one allocator each.
const INSTANCES: u64 = 60;
/// The number of instances of each class with faults in the long test: 10,000 in all. The environment variable
/// `ALLIANCE_LAW_INSTANCES` sets another one.
const MANY: u64 = 1429;

/// A run of an instance, as the laws see it.
struct Run {
    scenario: Scenario,
    seed: u64,
    events: Vec<EventRow>,
    log: RunLog,
}

fn parse(text: &str) -> Scenario {
    let vocabulary = Registry::built_in().vocabulary();
    let scenario = Scenario::parse("s.toml", text, &vocabulary);
    scenario.unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Runs a scenario to its end.
fn run(scenario: Scenario, seed: u64) -> Run {
    let vocabulary = Registry::built_in().vocabulary();
    let resolved = Setup::resolve(scenario.clone(), seed, None);
    let setup = resolved.unwrap_or_else(|error| panic!("{error}")).setup;
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    let log = RunLog::from_memory(&recorder.into_sink(), &vocabulary).unwrap();
    Run {
        scenario,
        seed,
        events: log.rows().unwrap(),
        log,
    }
}

/// Returns a random instance of a class as a scenario file: a function of its number.
type Instance = fn(u64, &mut ChaCha8Rng) -> String;

const CLASSES: [(&str, Instance); 7] = [
    ("windows", instances::windows_and_values),
    ("precedence", instances::precedence),
    ("coalitions", instances::coalitions),
    ("endurance", instances::endurance),
    ("deliveries", instances::deliveries),
    ("loads", instances::loads),
    ("paths", instances::paths),
];

/// Runs an instance and checks the laws. Returns the number of points that are done, and the hash.
fn check(text: &str, number: u64) -> (u64, Option<String>) {
    let checked = std::panic::catch_unwind(|| {
        let run = run(parse(text), number);
        laws::check(&run);
        laws::check_energy(&run);
        let done = run.log.run.result.mission.get("done").count();
        (done, run.log.run.hash.clone())
    });
    checked.unwrap_or_else(|_| panic!("instance {number}:\n{text}"))
}

/// Checks the laws on random instances of a class, and that every third repeats its hash.
fn check_class(name: &str, count: u64, instance: impl Fn(u64, &mut ChaCha8Rng) -> String) {
    let mut all_done = 0;
    for number in 0..count {
        let text = instance(number, &mut ChaCha8Rng::seed_from_u64(number));
        let (done, hash) = check(&text, number);
        all_done += done;
        if number % 3 == 0 {
            assert_eq!(hash, check(&text, number).1, "{name} {number}:\n{text}");
        }
    }
    eprintln!("{name}: {count} instances, {all_done} points done, 0 violations");
    assert!(all_done > 0, "{name}: some points are done");
}

fn check_named(name: &str) {
    let (_, instance) = CLASSES.iter().find(|(known, _)| *known == name).unwrap();
    check_class(name, INSTANCES, instance);
}

#[test]
fn windows_and_values() {
    check_named("windows");
}

#[test]
fn precedence() {
    check_named("precedence");
}

#[test]
fn coalitions() {
    check_named("coalitions");
}

#[test]
fn endurance() {
    check_named("endurance");
}

#[test]
fn deliveries() {
    check_named("deliveries");
}

#[test]
fn loads() {
    check_named("loads");
}

#[test]
fn paths() {
    check_named("paths");
}

/// Every allocator does all that a lone robot can do, if the time suffices.
#[test]
fn a_lone_robot_does_all() {
    for number in 0..INSTANCES {
        let text = instances::lone(number, &mut ChaCha8Rng::seed_from_u64(number));
        let run = run(parse(&text), number);
        laws::check(&run);
        let mission = &run.log.run.result.mission;
        let [done, total] = ["done", "total"].map(|name| mission.get(name).count());
        assert_eq!(done, total, "instance {number}:\n{text}");
    }
}

/// A robot continues its work if its estimate of the work left ends before the work, by rounding or a reduced skill.
#[test]
fn a_load_is_picked_up_after_the_estimated_end_of_the_work() {
    let reduced =
        "[[faults.timeline]]\nat_s = 0\nfault.skill = { robot = 'r0', skill = 't', share = 0.5 }\n";
    let cases = [0.001, 3.0, 4.0, 5.0, 7.5].map(|work_s| (work_s, ""));
    for (work_s, fault) in cases.into_iter().chain([(10.0, reduced)]) {
        let text = format!(
            "limit_s = 300\nroom = {{ width_m = 8, height_m = 6 }}\n[service]\n\
             [[service.kinds]]\nname = 't'\nwork_s = {{ min = {work_s}, max = {work_s} }}\n\
             [[robots]]\nname = 'r0'\n{fault}"
        );
        let text = starve::with_points(&text, &[(5.0, 3.0)], "deliver_to = [2, 1]");
        for allocator in ["alliance", "cbba", "nearest"] {
            let (run, counts) = starve::outcome(allocator, &text);
            laws::check(&run);
            assert_eq!(counts, [1, 1], "{allocator}, {work_s} s {fault}");
        }
    }
}

/// 10,000 instances of all classes, half of them with faults.
#[test]
#[ignore = "takes about ten minutes"]
fn many_with_faults() {
    let stated = std::env::var("ALLIANCE_LAW_INSTANCES").ok();
    let count = stated.map_or(MANY, |number| number.parse().expect("a whole number"));
    for (name, instance) in CLASSES {
        check_class(name, count, |number, chance| {
            let text = instance(number, chance);
            let faults = if chance.random_bool(0.5) {
                instances::faults(chance)
            } else {
                String::new()
            };
            text + &faults
        });
    }
}
