//! The controllers `Still` and `Listener` in Rust, with the package alliance-sim, and in plain Python
//! (tests/python/agent.py): all have the same hashes.
//!
//! `Still` stands still and reports that it is idle. `Listener` turns by the messages that it receives under link
//! faults.
//!
//! The Python program also reads and writes every message of the fuzz corpora.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use alliance_tests::harness::Lab;
use alliance_tests::python::python;
use alliance_tests::runs;
use in_process::{Team, joins_of};
use missions::Registry;
use proto::team::{Broadcast, BroadcastContent};
use robot_agent::allocator::{Allocator, AllocatorKind, Decision, Input, NoParameters, SelfState};
use robot_agent::mission::{ControllerInput, MissionController, Perception, StepOutput};
use run_log::{LogLevel, MemoryLog, MessageRow};
use scenario::ids::BehaviorId;
use scenario::{AllocatorSpec, Setup};
use serde::Deserialize;

/// The Python modules that the program needs.
const MODULES: [&str; 2] = ["zenoh", "xxhash"];

#[derive(Clone, Debug)]
struct Still {
    /// The turn rate, or `None` for a controller that ignores messages.
    turn_rad_s: Option<f32>,
    is_laden: bool,
}

impl MissionController for Still {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.is_laden = input.readings.mission.items().holding == Some(true);
        perception.applicable.resize(input.behaviors.len(), false);
        if let Some(turn_rad_s) = &mut self.turn_rad_s {
            let heartbeats = received
                .iter()
                .filter(|broadcast| matches!(broadcast.body, BroadcastContent::Heartbeat(_)));
            let shares = (1..).zip(heartbeats).map(|(place, broadcast)| {
                place * (u64::from(broadcast.sender.0) + 1) * (broadcast.sent.0 / 50 + 1)
            });
            *turn_rad_s = (shares.sum::<u64>() % 128) as f32 / 128.0;
        }
    }

    fn act(&mut self, _: &ControllerInput<'_>, _: Option<BehaviorId>, output: &mut StepOutput) {
        output.actuation.turn_rad_s = self.turn_rad_s.unwrap_or(0.0);
    }

    fn is_laden(&self) -> bool {
        self.is_laden
    }
}

#[derive(Clone, Debug)]
struct Idle;

impl Allocator for Idle {
    type Config = NoParameters;

    fn new(_: &SelfState, _: &NoParameters) -> Self {
        Self
    }

    fn step(&mut self, _: &Input<'_>, _: &mut Decision) {}
}

/// Returns a controller that stands still, or turns with this first rate.
fn still(name: &'static str, turn_rad_s: Option<f32>) -> AllocatorKind {
    let spec = AllocatorSpec {
        name,
        about: "stands",
        ..AllocatorSpec::alliance()
    };
    let new = move |_: &NoParameters, _, _: &Setup| Still {
        turn_rad_s,
        is_laden: false,
    };
    AllocatorKind::with_controller::<Idle, _>(spec, |_| Ok(NoParameters {}), new)
}

/// The settings of the runs, and the hashes by seed.
#[derive(Deserialize)]
struct Expected {
    scenario: String,
    limit_s: f64,
    faults: Vec<serde_json::Value>,
    hashes: BTreeMap<u64, String>,
}

/// Returns the expected results by the name of the controller.
fn expected() -> BTreeMap<String, Expected> {
    serde_json::from_str(include_str!("../../python/python/tests/still.json")).unwrap()
}

#[test]
fn still_and_listener_in_rust_have_the_hashes_of_the_python_versions() {
    let registry = Registry::built_in()
        .with_controller(still("still", None))
        .with_controller(still("listener", Some(0.0)));
    for (controller, expected) in expected() {
        assert_eq!(expected.hashes.len(), 3);
        for (seed, hash) in &expected.hashes {
            let mut table: toml::Table = toml::from_str(&expected.scenario).unwrap();
            let timeline = serde_json::json!({ "timeline": expected.faults });
            table.insert(
                "faults".to_owned(),
                toml::Value::try_from(timeline).unwrap(),
            );
            table.insert("limit_s".to_owned(), expected.limit_s.into());
            let scenario = scenario::Scenario::from_table(&table, &registry.vocabulary());
            let setup = runs::setup(scenario.unwrap(), *seed);
            let joins = joins_of(&setup);
            let team =
                Team::with_registry(&registry, setup, joins, LogLevel::Off, MemoryLog::default());
            let (_, recorder) = team.unwrap().run().unwrap();
            assert_eq!(&recorder.hash(), hash, "{controller}, seed {seed}");
        }
    }
}

/// Runs a controller by the plain Python program with each seed, and compares the hashes. Its answers to the log of
/// `run-1` must be the same.
#[track_caller]
fn run_by_program(lab: &Lab, python: &Path, controller: &str) {
    let expected = &expected()[controller];
    let faults: Vec<_> = expected.faults.iter().collect();
    let text = format!(
        "limit_s = {:?}\n{}\n[faults]\ntimeline = {}\n",
        expected.limit_s,
        expected.scenario,
        toml::Value::try_from(&faults).unwrap()
    );
    std::fs::write(lab.path("mine.toml"), text).unwrap();
    let command = format!(
        "--controller={controller}={} {} --controller {controller}",
        python.display(),
        script().display()
    );
    for (seed, hash) in &expected.hashes {
        let out = format!("run-{seed}");
        let seed = seed.to_string();
        lab.mission(&out, &["mine.toml", "--seed", &seed, &command])
            .expect(1);
        let log = lab.log(&out);
        let agent_log = std::fs::read_to_string(lab.path(&out).join("logs/gold.log")).unwrap();
        assert_eq!(
            log.run.hash.as_ref(),
            Some(hash),
            "seed {seed}: {agent_log}"
        );
        assert!(log.run.faults.iter().all(|fault| fault.hits > 0));
    }
    lab.run(&["replay", "run-1", &command]).expect(0);
}

#[test]
fn still_in_plain_python_has_the_same_hash() {
    if let Some(python) = python(&MODULES) {
        run_by_program(&Lab::new(), &python, "still");
    }
}

#[test]
fn listener_in_plain_python_has_the_same_hash_under_link_faults() {
    let Some(python) = python(&MODULES) else {
        return;
    };
    let lab = Lab::new();
    run_by_program(&lab, &python, "listener");
    for seed in expected()["listener"].hashes.keys() {
        let rows = lab.log(&format!("run-{seed}")).rows::<MessageRow>();
        let rows = rows
            .unwrap()
            .into_iter()
            .filter(|row| row.receiver == "gold");
        let deliveries: BTreeSet<String> = rows.map(|row| row.delivery).collect();
        for delivery in ["cut", "delayed", "dropped", "duplicate", "received"] {
            assert!(
                deliveries.contains(delivery),
                "{delivery} applies to no message"
            );
        }
    }
}

fn script() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("python/agent.py")
}

/// Returns every message of the corpus, by the program's type names.
fn corpus() -> BTreeMap<&'static str, Vec<std::path::PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus");
    let types = [
        ("tick-", "ToAgent"),
        ("report-", "Report"),
        ("broadcast-", "Broadcast"),
        ("join_request-", "JoinRequest"),
        ("join_reply-", "JoinReply"),
    ];
    let mut found: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for part in ["decode", "received"] {
        for entry in std::fs::read_dir(folder.join(part)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            let mut types = types.iter();
            let of = match part {
                "received" => Some("Broadcast"),
                _ => types
                    .find(|(start, _)| name.starts_with(start))
                    .map(|(_, of)| *of),
            };
            if let Some(of) = of {
                found.entry(of).or_default().push(path);
            }
        }
    }
    assert_eq!(found.len(), types.len());
    found
}

#[test]
fn the_python_agent_reads_and_writes_every_message_of_the_corpus() {
    let Some(python) = python(&MODULES) else {
        return;
    };
    for (of, files) in corpus() {
        let checked = Command::new(&python)
            .arg(script())
            .args(["--check", of])
            .args(files)
            .output();
        let checked = checked.unwrap();
        let stderr = String::from_utf8_lossy(&checked.stderr);
        assert!(checked.status.success(), "{of}: {stderr}");
    }
}
