//! Golden runs: a change without an intended effect must keep every byte.
//!
//! A golden file contains the hash and the figures of some runs. The hash covers every reading, command, message,
//! motivation and event of every tick, on any machine. The figures show the effect of a change in a diff.
//! `golden/waste-cleanup.json` has the default mission, `golden/MISSION.json` the scenarios of another mission, and
//! `golden/allocators/NAME.json` the runs of an allocator.
//!
//! After an intended change, or for a new allocator, update the files and check their diff:
//! `UPDATE_GOLDEN=1 cargo test -p alliance-tests --test missions golden`.
//!
//! These runs use one process. Other tests check that processes write the same bytes.

use std::path::PathBuf;

use alliance_tests::runs::{allocators, builtin, run, setup, vocabulary};
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

/// Returns the default mission as `alliance run --limit … --step-order …` resolves it.
fn scenario(limit_s: f64, order: StepOrder) -> Scenario {
    Scenario {
        limit_s,
        step_order: Some(order),
        ..default_scenario()
    }
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
        pins.insert(name, pinned(setup(scenario(limit_s, order), seed)));
    }
    assert_as_before("waste-cleanup", pins);
}

/// Compares the default mission and a service mission of each allocator. The default mission of ALLIANCE is in
/// another file.
#[test]
fn golden_runs_of_allocators_are_unchanged() {
    for allocator in allocators() {
        let mut pins = Map::new();
        if allocator != Scenario::DEFAULT_ALLOCATOR {
            let mut setup = setup(scenario(3600.0, StepOrder::Simultaneous), 1);
            setup.scenario.allocator = Some(allocator.to_owned());
            pins.insert("waste-cleanup".to_owned(), pinned(setup));
        }
        let mut scenario = service(allocator, "");
        scenario.limit_s = 400.0;
        pins.insert("service".to_owned(), pinned(setup(scenario, 1)));
        assert_as_before(&format!("allocators/{allocator}"), pins);
    }
}

/// Compares the built-in scenarios of all missions but waste with their golden files, each up to a time limit. A large
/// team takes a thousand times as long per tick as a small one.
#[test]
fn golden_runs_of_other_missions_are_unchanged() {
    let missions = vocabulary().missions;
    for mission in missions.iter().filter(|mission| **mission != WASTE) {
        let mut pins = Map::new();
        for known in mission.vocabulary().scenarios {
            let mut setup = setup(builtin(known.name), 1);
            let limit_s = match setup.scenario.robots.len() {
                0..=10 => 1_200.0,
                _ => 120.0,
            };
            setup.scenario.limit_s = setup.scenario.limit_s.min(limit_s);
            pins.insert(known.name.to_owned(), pinned(setup));
        }
        assert_as_before(mission.name(), pins);
    }
}

/// Compares runs with a golden file, or updates the file.
#[track_caller]
pub fn assert_as_before(name: &str, runs: Map<String, Value>) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("golden/{name}.json"));
    let now = format!("{:#}\n", Value::Object(runs));
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &now).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap_or_default();
    let remedy = "if the change is intended, update it with UPDATE_GOLDEN=1";
    assert!(
        now == golden,
        "golden/{name}.json differs; {remedy}\nnow:\n{now}\ngolden:\n{golden}"
    );
}
