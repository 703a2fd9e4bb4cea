//! `alliance run --in-process` writes the same bytes as many processes, with any faults.
//!
//! A normal test covers a part. `ALLIANCE_PARITY=all` runs every built-in scenario with ten seeds and a hundred
//! random fault timelines.

use std::collections::BTreeSet;
use std::fmt::Write;

use alliance_tests::harness::Lab;
use alliance_tests::runs::{allocators, builtin, vocabulary};
use alliance_tests::testkit::{ROBOTS, loss_and_kill};
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::RunFile;

/// The number of fault kinds in a [`timeline`].
const KINDS: usize = 13;

/// Returns `all` if the environment requests the full test, otherwise `some`.
fn amount(all: u64, some: u64) -> u64 {
    match std::env::var("ALLIANCE_PARITY") {
        Ok(value) if value == "all" => all,
        _ => some,
    }
}

/// Runs a scenario by processes and in one process, compares them, and returns run.json.
#[track_caller]
fn check(arguments: &[&str]) -> RunFile {
    check_in(&Lab::new(), arguments)
}

#[track_caller]
fn check_in(lab: &Lab, arguments: &[&str]) -> RunFile {
    let many = lab.mission("many", arguments);
    let one = lab.run(&[&["run", "--in-process", "--out", "one"], arguments].concat());
    let status = many.status.code();
    assert!(
        matches!(status, Some(0 | 1)),
        "{arguments:?}: {}",
        many.stderr
    );
    assert_eq!(one.status.code(), status, "{arguments:?}: {}", one.stderr);
    lab.assert_same_bytes("many", "one");
    let run = |out: &str| std::fs::read_to_string(lab.path(out).join("run.json")).unwrap();
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
            let (seed, limit) = (seed.to_string(), limit.to_string());
            let arguments = [name, "--seed", &seed, "--limit", &limit];
            // Every table, of a team of many behavior sets, too.
            check(&[&arguments[..], &["--log", "full"]].concat());
        }
    }
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
        std::fs::write(lab.path("s.toml"), scenario.to_toml().unwrap()).unwrap();
        let run = check_in(&lab, &["s.toml"]);
        assert_eq!(run.faults[1].hits, 1, "{allocator}: {:?}", run.faults);
        lab.run(&["replay", "many"]).expect(0);
    }
}

/// Each robot of this team has only some teammates in radio range.
#[test]
fn a_large_team_with_radio_range_has_the_same_bytes() {
    check(&["--robots", "22", "--spills", "15", "--limit", "15"]);
}

#[test]
fn random_fault_timelines_have_the_same_bytes() {
    let days = amount(100, 5);
    let mut hit = BTreeSet::new();
    for day in 0..days {
        let lab = Lab::new();
        std::fs::write(lab.path("day.toml"), timeline(day)).unwrap();
        let order = ["simultaneous", "in-order"][day as usize % 2];
        let seed = day.to_string();
        let run = check_in(
            &lab,
            &[
                "day.toml",
                "--limit",
                "120",
                "--seed",
                &seed,
                "--step-order",
                order,
            ],
        );
        let effective = run.faults.iter().filter(|fault| fault.hits > 0);
        hit.extend(effective.map(|fault| fault.order.fault.name().to_owned()));
    }
    // Faults without an effect would test nothing.
    let expected = if days < 100 { 5 } else { KINDS };
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
        std::fs::write(lab.path("early.toml"), early).unwrap();
        let run = check_in(&lab, &["early.toml", "--limit", "5"]);
        assert_eq!(run.faults[0].hits, 1, "attempt {attempt}");
    }
}

/// Returns a scenario with three to ten faults at random times within two minutes.
fn timeline(seed: u64) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut text = "name = \"day\"\n".to_owned();
    for _ in 0..rng.random_range(3..=10) {
        let a = *ROBOTS.choose(&mut rng).unwrap();
        let b = *ROBOTS
            .iter()
            .filter(|name| **name != a)
            .collect::<Vec<_>>()
            .choose(&mut rng)
            .unwrap();
        let p = rng.random_range(0.05..0.9_f64);
        let device = [
            "position",
            "avoidance",
            "waste",
            "gripper",
            "spill-zone",
            "front-border",
        ]
        .choose(&mut rng)
        .unwrap();
        let (x, y) = (
            rng.random_range(3.0..9.0_f64),
            rng.random_range(1.0..8.0_f64),
        );
        let fault = match rng.random_range(0..18) {
            0 | 1 => format!("kill = '{a}'"),
            2 => format!("terminate = '{a}'"),
            3 | 4 => format!("pause = '{a}'"),
            5 => format!("restart = '{a}'"),
            6 => format!("drop = {{ from = '{a}', p = {p} }}"),
            7 => format!("drop = {{ p = {p}, burst_s = 2.0 }}"),
            8 => format!("delay = {{ from = '{a}', to = '{b}', delay_s = {p}, jitter_s = 1.0 }}"),
            9 => format!("partition = {{ groups = [['{a}'], ['{b}']] }}"),
            10 => format!("mute = '{a}'"),
            11 => format!("deaf = '{a}'"),
            12 => format!("duplicate = {{ p = {p} }}"),
            13 => format!("sensor = {{ robot = '{a}', device = '{device}', mode = 'dead' }}"),
            14 => format!("sensor = {{ robot = '{a}', device = '{device}', mode = 'stuck' }}"),
            15 => format!(
                "sensor = {{ robot = '{a}', device = 'position', mode = {{ noise = {{ m = {p} }} }} }}"
            ),
            16 => format!("actuator = {{ robot = '{a}', mode = {{ slowed = {p} }} }}"),
            _ => format!("obstacle = {{ x_m = {x}, y_m = {y}, width_m = 0.5, height_m = 0.7 }}"),
        };
        let at = rng.random_range(0.0..110.0_f64);
        writeln!(text, "[[faults.timeline]]\nfault.{fault}\nat_s = {at:.2}").unwrap();
        let is_instant = fault.starts_with("restart");
        if !is_instant && rng.random_bool(0.7) {
            let length = rng.random_range(1.0..30.0_f64);
            writeln!(text, "for_s = {length:.2}").unwrap();
        }
    }
    text
}

#[test]
fn options_that_need_processes_are_refused_in_one_line() {
    let lab = Lab::new();
    for arguments in [
        ["--speed", "5x"].as_slice(),
        &["--open"],
        &["--paused"],
        &["--stall-after", "3"],
    ] {
        let refused = lab
            .run(&[&["run", "--in-process"], arguments].concat())
            .expect(2);
        assert!(
            refused
                .stderr
                .starts_with("alliance: the argument '--in-process' cannot be used with"),
            "{}",
            refused.stderr
        );
        assert_eq!(refused.stderr.lines().count(), 1);
    }
    assert!(!lab.path("runs").exists());
}
