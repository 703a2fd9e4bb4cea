//! The controllers `Still` and `Listener` in Rust, with the package alliance-sim, and in plain Python
//! (tests/python/agent.py): all have the same hashes.
//!
//! `Still` stands still and reports that it is idle. `Listener` turns by the messages that it receives under link
//! faults.
//!
//! The Python program also reads and writes every message of the fuzz corpora.

use std::collections::BTreeMap;
use std::sync::Arc;

use alliance_tests::damage::corpus;
use alliance_tests::harness::Lab;
use alliance_tests::python::{python, run};
use alliance_tests::runs;
use alliance_tests::testkit::in_repository;
use in_process::{Team, joins_of};
use missions::Registry;
use proto::team::{Broadcast, BroadcastContent};
use robot_agent::allocator::{Allocator, AllocatorKind, Decision, Input, NoParameters, SelfState};
use robot_agent::mission::{ControllerInput, MissionController, Perception, StepOutput};
use run_log::{LogLevel, MemoryLog, MessageRow};
use scenario::ids::BehaviorId;
use scenario::{AllocatorSpec, Scenario, Setup};
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
            let is_heartbeat = |broadcast: &&Arc<Broadcast>| {
                matches!(broadcast.body, BroadcastContent::Heartbeat(_))
            };
            let heartbeats = received.iter().filter(is_heartbeat);
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

impl Expected {
    fn text(&self) -> String {
        let faults = toml::Value::try_from(&self.faults).unwrap();
        let (limit_s, scenario) = (self.limit_s, &self.scenario);
        format!("limit_s = {limit_s:?}\n{scenario}\n[faults]\ntimeline = {faults}\n")
    }
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
            let text = expected.text();
            let scenario = Scenario::parse("s.toml", &text, &registry.vocabulary());
            let setup = runs::setup(scenario.unwrap(), *seed);
            let joins = joins_of(&setup);
            let team =
                Team::with_registry(&registry, setup, joins, LogLevel::Off, MemoryLog::default());
            let (_, recorder) = team.unwrap().run().unwrap();
            assert_eq!(&recorder.hash(), hash, "{controller}, seed {seed}");
        }
    }
}

/// Runs a controller by a program with each seed, and compares the hashes. Its answers to the log of `run-1` must be the
/// same.
#[track_caller]
pub fn run_by_program(lab: &Lab, program: &str, controller: &str) {
    let expected = &expected()[controller];
    lab.write("mine.toml", expected.text());
    let command = format!("--controller={controller}={program} --controller {controller}");
    for (seed, hash) in &expected.hashes {
        let (out, seed) = (format!("run-{seed}"), seed.to_string());
        let arguments = ["mine.toml", "--seed", &seed, &command];
        lab.mission(&out, arguments).expect(1);
        let log = lab.log(&out);
        let agent_log = lab.text(&format!("{out}/logs/gold.log"));
        let found = log.run.hash.as_ref();
        assert_eq!(found, Some(hash), "seed {seed}: {agent_log}");
        assert!(log.run.faults.iter().all(|fault| fault.hits > 0));
    }
    lab.run(["replay", "run-1", &command]).expect(0);
}

/// Returns the words of the plain Python program; `None` if the test may be skipped.
pub fn program() -> Option<String> {
    let script = in_repository("tests/python/agent.py");
    python(&MODULES).map(|python| format!("{} {}", python.display(), script.display()))
}

#[test]
fn still_in_plain_python_has_the_same_hash() {
    if let Some(program) = program() {
        run_by_program(&Lab::new(), &program, "still");
    }
}

#[test]
fn listener_in_plain_python_has_the_same_hash_under_link_faults() {
    if let Some(program) = program() {
        check_listener(&program);
    }
}

/// Runs the listener by a program, and checks that each effect of links applies to its messages.
#[track_caller]
pub fn check_listener(program: &str) {
    let lab = Lab::new();
    run_by_program(&lab, program, "listener");
    for seed in expected()["listener"].hashes.keys() {
        let mut rows = lab
            .log(&format!("run-{seed}"))
            .rows::<MessageRow>()
            .unwrap();
        rows.retain(|row| row.receiver == "gold");
        for delivery in ["cut", "delayed", "dropped", "duplicate", "received"] {
            let applies = rows.iter().any(|row| row.delivery == delivery);
            assert!(applies, "{delivery} applies to no message");
        }
    }
}

/// Writes every message of the corpus to files, by the program's type names.
fn corpus_files(lab: &Lab) -> BTreeMap<&'static str, Vec<String>> {
    let types = [
        ("tick-", "ToAgent"),
        ("report-", "Report"),
        ("broadcast-", "Broadcast"),
        ("join_request-", "JoinRequest"),
        ("join_reply-", "JoinReply"),
    ];
    let received = corpus("received").into_iter();
    let received = received.map(|(name, bytes)| (format!("broadcast-{name}"), bytes));
    let mut found: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for (name, bytes) in received.chain(corpus("decode")) {
        if let Some((_, of)) = types.iter().find(|(start, _)| name.starts_with(start)) {
            lab.write(&name, bytes);
            found.entry(*of).or_default().push(name);
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
    let lab = Lab::new();
    for (of, files) in corpus_files(&lab) {
        let arguments = ["--check".to_owned(), of.to_owned()]
            .into_iter()
            .chain(files);
        let arguments: Vec<String> = arguments.collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        run(&lab, &python, "agent.py", &arguments);
    }
}
