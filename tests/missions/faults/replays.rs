//! A run with manual signals at any wall-clock time and with live orders is repeated from its log alone.

use missions::Registry;
use missions::waste::data::default_scenario;
use std::time::Duration;

use alliance_tests::mishaps::{self, Rates};
use alliance_tests::storm::{self, Coverage};
use analysis::diff::{Comparison, compare};
use analysis::replay::replay;
use nix::sys::signal::Signal;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{Input, RunLog};
use scenario::{Preset, Scenario, Setup, StepOrder};

use super::assert_items_accounted_for;
use crate::harness::Lab;
use crate::team::Team;

/// The number of runs by real processes. `ALLIANCE_REPLAYS` overrides it.
const RUNS: u64 = 5;

#[test]
fn a_manually_disturbed_run_is_repeated_byte_for_byte() {
    let runs = std::env::var("ALLIANCE_REPLAYS").map_or(RUNS, |runs| runs.parse().unwrap());
    let mut disturbances = 0;
    for seed in 0..runs {
        let lab = Lab::new();
        disturbances += disturb(&lab, seed);
        let log = lab.log("run");
        assert_items_accounted_for(&log);
        let finished = lab.run(&["replay", "run", "--out", "again"]).expect(0);
        assert!(finished.answer().starts_with("identical"));
        lab.run(&["diff", "run", "again"]).expect(0);
        lab.assert_same_bytes("run", "again");
    }
    assert!(disturbances > 3 * runs, "{disturbances} in {runs} runs");
}

/// Runs a mission at full speed with random disturbances, and returns their number.
fn disturb(lab: &Lab, seed: u64) -> u64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mission = lab.mission_of(60);
    let mut team = Team::start(lab, &[&mission, "--seed", &seed.to_string()]);
    team.wait_for_row("events.csv", &["joined"]);
    let robots = ["blue", "gold", "green"];
    let mut disturbances = 0;
    let mut stopped: Option<&str> = None;
    for _ in 0..8 {
        std::thread::sleep(Duration::from_millis(rng.random_range(1..120)));
        if !team.is_running() {
            break;
        }
        let robot = robots[rng.random_range(0..3)];
        match (rng.random_range(0..5), stopped.take()) {
            (_, Some(stopped)) => team.try_signal(stopped, Signal::SIGCONT),
            (0, None) => team.try_signal(robot, Signal::SIGKILL),
            (1, None) => {
                team.try_signal(robot, Signal::SIGSTOP);
                stopped = Some(robot);
            }
            (2, None) => {
                let _ = lab.run(&["fault", "restart", robot]);
            }
            (3, None) => {
                let _ = lab.run(&[
                    "fault", "drop", "--from", robot, "--p", "0.5", "--for", "20s",
                ]);
            }
            (_, None) => {
                let _ = lab.run(&["fault", "pause", robot, "--for", "3s"]);
            }
        }
        disturbances += 1;
    }
    if let Some(stopped) = stopped {
        team.try_signal(stopped, Signal::SIGCONT);
    }
    // The run is complete, or no robot was left.
    let finished = team.wait();
    assert!(
        matches!(finished.status.code(), Some(0 | 1)),
        "{}",
        finished.stderr
    );
    disturbances
}

#[test]
fn a_disturbed_run_in_one_process_is_repeated() {
    for seed in 0..24 {
        let order = [StepOrder::Simultaneous, StepOrder::InOrder][seed as usize % 2];
        let mut scenario = Scenario {
            limit_s: 400.0,
            ..default_scenario()
        };
        scenario.alliance.preset = [Preset::Team, Preset::Thesis, Preset::Par98][seed as usize % 3];
        scenario.step_order = Some(order);
        let setup = Setup::resolve(scenario, seed, None).unwrap().setup;
        let rates = Rates {
            loss: 0.02,
            death: 0.002,
            stall: 0.005,
            back: 0.02,
            // A low rate per order index: some orders arrive while a process is awaited, some between ticks.
            order: 0.002,
        };
        let recorder = mishaps::run(&setup, rates, seed).unwrap();
        let logged =
            RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
        let inputs = logged.inputs().unwrap();
        let orders = inputs
            .iter()
            .filter(|line| matches!(line.input, Input::Order { .. }));
        assert!(inputs.len() > 20 && orders.count() > 5);
        let (_, again) = replay(&logged, logged.run.log, |_| {}).unwrap();
        let comparison = compare(&logged, &again).unwrap();
        assert!(
            matches!(comparison, Comparison::Identical { .. }),
            "seed {seed}: {comparison}"
        );
    }
}

/// Runs the fault fuzzer in one process: the log contains all external inputs in an order that repeats the run. `ALLIANCE_STORMS` sets
/// the number of cases.
#[test]
fn every_run_of_the_fault_fuzzer_is_repeated() {
    let storms = std::env::var("ALLIANCE_STORMS").map_or(300, |storms| storms.parse().unwrap());
    let mut coverage = Coverage::new();
    for seed in 0..storms {
        let order = [StepOrder::Simultaneous, StepOrder::InOrder][seed as usize % 2];
        let scenario = Scenario {
            step_order: Some(order),
            ..default_scenario()
        };
        let setup = Setup::resolve(scenario, seed, None).unwrap().setup;
        let recorder = storm::run(&setup, 150, seed, &mut coverage).unwrap();
        let logged =
            RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
        // The run is empty if no agent joined.
        if logged.last.is_none() {
            continue;
        }
        let (_, again) = replay(&logged, logged.run.log, |_| {}).unwrap();
        let comparison = compare(&logged, &again).unwrap();
        assert!(
            matches!(comparison, Comparison::Identical { .. }),
            "seed {seed}: {comparison}"
        );
    }
    let inputs: std::collections::BTreeSet<_> = coverage.keys().map(|(input, _)| input).collect();
    println!(
        "{} kinds of inputs in {} states, {} in all",
        inputs.len(),
        coverage.len(),
        coverage.values().sum::<u64>()
    );
    assert_eq!(inputs.len(), 12);
    assert!(coverage.len() > 400, "{}", coverage.len());
}

#[test]
fn a_difference_is_reported_with_tick_robot_and_field() {
    let lab = Lab::new();
    lab.mission("a", &["--limit", "60"]).expect(1);
    let altered = "[alliance.robots.gold.sets.find-locations-wander]\nfast_impatience = 2.0\n";
    std::fs::write(lab.path("other.toml"), altered).unwrap();
    lab.mission("b", &["other.toml", "--limit", "60"]).expect(1);
    let finished = lab.run(&["diff", "a", "b"]).expect(1);
    let (cause, line) = finished.stderr.split_once('\n').unwrap();
    assert!(
        cause.starts_with("scenario: alliance.robots.gold"),
        "{cause}"
    );
    assert!(
        line.starts_with(
            "differs first in tick 0 (0.000 s): gold motivations, motivations.csv: impatience"
        ),
        "{line}"
    );
    let json = lab.run(&["diff", "a", "b", "--json"]).expect(1).json();
    assert_eq!(json["result"], "differs");
    assert_eq!(json["robot"], "gold");

    // A changed parameter changes the replay.
    let path = lab.path("a").join("run.json");
    let mut run: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    run["scenario"]["body"]["speed_m_s"] = 0.4.into();
    std::fs::write(&path, run.to_string()).unwrap();
    let finished = lab.run(&["replay", "a"]).expect(1);
    assert!(finished.answer().starts_with("differs first in tick"));
    lab.run(&["replay", "nowhere"]).expect(2);
}
