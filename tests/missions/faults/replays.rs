//! A run with external inputs in any order is repeated from its log alone, and a difference is named.

use std::collections::BTreeSet;

use alliance_tests::fault_fuzzer::{self, Coverage, Fuzz};
use alliance_tests::harness::Lab;
use alliance_tests::runs::{log_of, setup};
use missions::waste::data::default_scenario;
use scenario::{Preset, StepOrder};

use super::assert_replay_is_identical;

/// Runs the fault fuzzer in one process: the log contains all external inputs in an order that repeats the run.
/// `ALLIANCE_STORMS` sets the number of cases.
#[test]
fn every_run_of_the_fault_fuzzer_is_repeated() {
    let storms = std::env::var("ALLIANCE_STORMS").map_or(300, |storms| storms.parse().unwrap());
    let mut coverage = Coverage::new();
    for seed in 0..storms {
        let mut scenario = default_scenario();
        let orders = [StepOrder::Simultaneous, StepOrder::InOrder];
        scenario.step_order = Some(orders[seed as usize % 2]);
        let presets = [Preset::Team, Preset::Thesis, Preset::Par98];
        scenario.alliance.preset = presets[seed as usize % 3];
        let fuzz = Fuzz {
            seed,
            ticks: 150,
            calm: 0.0,
            loss: 0.02,
        };
        let recorder = fault_fuzzer::run(&setup(scenario, seed), fuzz, &mut coverage);
        let logged = log_of(recorder.unwrap());
        // The run is empty if no agent joined.
        if logged.last.is_some() {
            assert_replay_is_identical(&logged);
        }
    }
    let inputs: BTreeSet<_> = coverage.keys().map(|(input, _)| input).collect();
    assert_eq!(inputs.len(), 12);
    assert!(coverage.len() > 400, "{}", coverage.len());
}

#[test]
fn a_difference_is_reported_with_tick_robot_and_field() {
    let lab = Lab::new();
    lab.mission("a", "--limit 60").expect(1);
    let altered = "[alliance.robots.gold.sets.find-locations-wander]\nfast_impatience = 2.0\n";
    lab.write("other.toml", altered);
    lab.mission("b", "other.toml --limit 60").expect(1);
    let stderr = lab.run("diff a b").expect(1).stderr;
    assert!(
        stderr.starts_with("scenario: alliance.robots.gold"),
        "{stderr}"
    );
    let first =
        "\ndiffers first in tick 0 (0.000 s): gold motivations, motivations.csv: impatience";
    assert!(stderr.contains(first), "{stderr}");
    let json = lab.run("diff a b --json").expect(1).json();
    assert_eq!(json["result"], "differs");
    assert_eq!(json["robot"], "gold");

    // A changed parameter changes the replay.
    let mut run = lab.json("a/run.json");
    run["scenario"]["body"]["speed_m_s"] = 0.4.into();
    lab.write("a/run.json", run.to_string());
    let finished = lab.run("replay a").expect(1);
    assert!(finished.answer().starts_with("differs first in tick"));
    lab.run("replay nowhere").expect(2);
}
