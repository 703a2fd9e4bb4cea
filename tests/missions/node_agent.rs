//! The agent in JavaScript (tests/node/agent.mjs), written from docs/WIRE.md and docs/wire.schema.json alone: the same
//! controllers have the same hashes as in Rust and in Python.

use std::process::Command;

use alliance_tests::harness::Lab;
use alliance_tests::needs::cannot_run;
use alliance_tests::python::python;
use alliance_tests::testkit::in_repository;
use proto::join::PROTOCOL_VERSION;
use run_log::EventRow;

use crate::python_still;

/// Two robots of the mission service, one of them with an external controller that is killed, restarted and misses
/// messages.
const WORKER: &str = "
name = 'worker'
limit_s = 150.0
[service]
kinds = [
  { name = 'dust', work_s = { min = 1, max = 3 } },
  { name = 'garbage', work_s = { min = 2, max = 4 } },
]
random = [{ n = 8, rate_hz = 0.2 }]
points = [{ kind = 'dust', x_m = 2, y_m = 4 }, { kind = 'garbage', x_m = 5, y_m = 3 }]
[[robots]]
name = 'blue'
[[robots]]
name = 'gold'
controller = 'worker'
[faults]
timeline = [
  { fault = { kill = 'gold' }, at_s = 20.0, for_s = 3.0 },
  { fault = { drop = { p = 0.3 } }, at_s = 5.0 },
]
";

/// Returns the path of the agent; `None` without Node.js, if the test may be skipped.
fn script() -> Option<String> {
    if Command::new("node").arg("--version").output().is_err() {
        cannot_run("no Node.js");
        return None;
    }
    Some(in_repository("tests/node/agent.mjs").display().to_string())
}

/// Returns the words of the agent; `None` if the test may be skipped.
fn program() -> Option<String> {
    let script = script()?;
    let python = python(&["zenoh"])?;
    Some(format!("node {script} --python {}", python.display()))
}

#[test]
fn the_javascript_agent_agrees_with_the_test_vectors() {
    let Some(script) = script() else {
        return;
    };
    let output = Command::new("node")
        .args([&script, "--check"])
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    let expected = format!(" vectors of version {PROTOCOL_VERSION} match");
    assert!(stdout.contains(&expected), "{stdout}");
}

#[test]
fn still_in_javascript_has_the_same_hash() {
    if let Some(program) = program() {
        python_still::run_by_program(&Lab::new(), &program, "still");
    }
}

#[test]
fn listener_in_javascript_has_the_same_hash_under_link_faults() {
    if let Some(program) = program() {
        python_still::check_listener(&program);
    }
}

#[test]
fn a_worker_in_javascript_completes_service_with_the_hash_of_the_one_in_python() {
    let (Some(javascript), Some(python)) = (program(), python_still::program()) else {
        return;
    };
    let lab = Lab::new();
    lab.write("worker.toml", WORKER);
    let hashes = [("javascript", javascript), ("python", python)].map(|(out, program)| {
        let command = format!("--controller=worker={program} --controller worker");
        lab.mission(out, ["worker.toml", "--seed", "2", &command])
            .expect(0);
        lab.run(["replay", out, &command]).expect(0);
        let log = lab.log(out);
        let mut done = log.rows::<EventRow>().unwrap();
        done.retain(|row| row.robot == "gold" && row.kind == "done");
        assert!(done.len() >= 2, "{} points", done.len());
        log.run.hash
    });
    assert!(hashes[0].is_some());
    assert_eq!(hashes[0], hashes[1]);
}
