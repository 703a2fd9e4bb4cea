//! Golden runs: a change without an intended effect must keep every byte.
//!
//! `golden/waste-cleanup.json` contains the hash and the figures of some runs of the default mission. The hash covers
//! every reading, command, message, motivation and event of every tick, on any machine. The figures show the effect
//! of a change in a diff. `golden/allocators.json` has the other allocators, `golden/allocators-service.json` all
//! allocators in a service mission, and `golden/NAME.json` the other missions.
//!
//! After an intended change, update the files and check their diff:
//! `UPDATE_GOLDEN=1 cargo test -p alliance-tests --test missions golden`.
//!
//! These runs use one process. Other tests check that processes write the same bytes.

use std::path::PathBuf;

use alliance_tests::runs::{self, allocators, builtin, run, vocabulary};
use missions::waste::data::{WASTE, default_scenario};
use run_log::{Document, LogLevel};
use scenario::{Scenario, Setup, StepOrder};
use serde_json::{Map, Value, json};

use crate::allocators::service;

/// Seed, simulated seconds, step order. The first run is short, the others run until the mission is complete.
const RUNS: [(u64, f64, StepOrder); 5] = [
    (1, 60.0, StepOrder::Simultaneous),
    (1, 3600.0, StepOrder::Simultaneous),
    (2, 3600.0, StepOrder::Simultaneous),
    (3, 3600.0, StepOrder::Simultaneous),
    (1, 3600.0, StepOrder::InOrder),
];

/// Returns the default mission as `alliance run --seed … --limit … --step-order …` resolves it.
fn setup(seed: u64, limit_s: f64, order: StepOrder) -> Setup {
    let scenario = Scenario {
        limit_s,
        step_order: Some(order),
        ..default_scenario()
    };
    runs::setup(scenario, seed)
}

pub fn pinned(setup: Setup) -> Value {
    let (_, recorder) = run(setup, LogLevel::Off);
    let memory = recorder.into_sink();
    let file: Value = serde_json::from_str(&memory.documents[&Document::Run]).unwrap();
    json!({
        "hash": file["hash"],
        "outcome": file["outcome"],
        "result": file["result"],
    })
}

#[test]
fn golden_runs_are_unchanged() {
    let mut pins = Map::new();
    for (seed, limit_s, order) in RUNS {
        let name = format!("seed {seed}, at most {limit_s} s, {}", order.as_str());
        pins.insert(name, pinned(setup(seed, limit_s, order)));
    }
    assert_as_before("golden/waste-cleanup.json", pins);
}

/// Compares the default mission of each allocator but ALLIANCE with the golden file.
#[test]
fn golden_runs_of_allocators_are_unchanged() {
    let mut pins = Map::new();
    for allocator in allocators().filter(|name| *name != "alliance") {
        let mut setup = setup(1, 3600.0, StepOrder::Simultaneous);
        setup.scenario.allocator = Some(allocator.to_owned());
        pins.insert(allocator.to_owned(), pinned(setup));
    }
    assert_as_before("golden/allocators.json", pins);
}

#[test]
fn golden_runs_of_service_by_every_allocator_are_unchanged() {
    let mut pins = Map::new();
    for allocator in allocators() {
        let mut scenario = service(allocator, "");
        scenario.limit_s = 400.0;
        pins.insert(allocator.to_owned(), pinned(runs::setup(scenario, 1)));
    }
    assert_as_before("golden/allocators-service.json", pins);
}

/// Compares the built-in scenarios of all missions but waste with their golden files, each up to a time limit. A large
/// team takes a thousand times as long per tick as a small one.
#[test]
fn golden_runs_of_other_missions_are_unchanged() {
    let missions = vocabulary().missions;
    for mission in missions.iter().filter(|mission| **mission != WASTE) {
        let mut pins = Map::new();
        for scenario in mission.vocabulary().scenarios {
            let mut setup = runs::setup(builtin(scenario.name), 1);
            let limit_s = match setup.scenario.robots.len() {
                0..=10 => 1_200.0,
                _ => 120.0,
            };
            setup.scenario.limit_s = setup.scenario.limit_s.min(limit_s);
            pins.insert(scenario.name.to_owned(), pinned(setup));
        }
        assert_as_before(&format!("golden/{}.json", mission.name()), pins);
    }
}

/// Compares runs with a golden file, or updates the file.
#[track_caller]
pub fn assert_as_before(file: &str, runs: Map<String, Value>) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(file);
    let now = format!("{:#}\n", Value::Object(runs));
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &now).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        now == golden,
        "{} differs; if the change is intended, update it with UPDATE_GOLDEN=1\nnow:\n{now}\ngolden:\n{golden}",
        path.display()
    );
}
