//! Orders to a live mission from the command line: when they take effect, the clock, and refusals.

use serde_json::Value;

use super::{at, events, hit};
use crate::harness::{Finished, Lab};
use crate::team::Team;

/// Runs an `alliance` command against the live run and returns its JSON reply.
#[track_caller]
fn query(lab: &Lab, arguments: &[&str]) -> Value {
    let mut all = arguments.to_vec();
    all.push("--json");
    lab.run(&all).expect(0).json()
}

#[track_caller]
fn refused(lab: &Lab, arguments: &[&str], line: &str) {
    let finished: Finished = lab.run(arguments).expect(2);
    assert_eq!(finished.stderr.trim_end(), line);
    assert_eq!(finished.stdout, "");
}

#[test]
fn a_paused_clock_steps_and_applies_orders_at_once() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "10x"]);
    team.wait_for_row("poses.csv", &["5000,"]);
    let paused = query(&lab, &["clock", "pause"]);
    let tick = paused["clock"]["tick"].as_u64().unwrap();
    let status = || query(&lab, &["status"])["status"].clone();
    let now = || status()["tick"].as_u64().unwrap();
    // The current tick may end, but no other one begins.
    let paused_tick = now();
    assert!(paused_tick <= tick + 1);
    assert_eq!(now(), paused_tick);

    let obstacle = ["fault", "obstacle", "6", "4", "0.5", "0.5", "--id", "box"];
    let armed = query(&lab, &obstacle)["armed"].clone();
    assert_eq!(
        armed["tick"].as_u64(),
        Some(paused_tick),
        "in the very tick"
    );
    let faults = status()["faults"].clone();
    assert_eq!(faults[0]["id"], "box");
    assert_eq!(faults[0]["phase"], "in-force");
    assert_eq!(now(), paused_tick, "the clock must not move");

    // Orders take effect in the order in which they are given.
    query(&lab, &["fault", "mute", "blue", "--id", "first"]);
    query(&lab, &["fault", "clear", "first"]);
    let over = query(&lab, &["fault", "list"])["faults"].clone();
    assert_eq!(
        (&over[1]["id"], &over[1]["phase"]),
        (&"first".into(), &"over".into())
    );
    query(&lab, &["clock", "step", "3"]);
    crate::harness::wait_until("three steps", || now() == paused_tick + 3);
    assert_eq!(now(), paused_tick + 3);
    query(&lab, &["clock", "speed", "max"]);
    assert_eq!(now(), paused_tick + 3, "a new speed must not end the pause");
    query(&lab, &["clock", "resume"]);
    team.wait().expect(0);

    let log = lab.log("run");
    hit(&log, "box");
    let applied = events(&log, "applied", None);
    assert_eq!(applied[0].t_ms, at(paused_tick as f64 * 0.05));
    assert_eq!(applied[0].detail, "obstacle 6 4 0.5 0.5");
    assert!(!log.run.unscripted);
    lab.run(&["replay", "run"]).expect(0);
}

#[test]
fn orders_are_listed_cleared_and_logged() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "20x"]);
    team.wait_for_row("poses.csv", &["2000,"]);
    let killed = query(&lab, &["fault", "kill", "gold", "--id", "k"]);
    let tick = killed["armed"]["tick"].as_u64().unwrap();
    team.wait_for_row("events.csv", &[",gone,gold,"]);
    let waiting = [
        "fault",
        "mute",
        "blue",
        "--when",
        "any delivers",
        "--for",
        "5s",
    ];
    let waiting = query(&lab, &waiting)["armed"].clone();
    assert_eq!(waiting["tick"], Value::Null);
    let list = query(&lab, &["fault", "list"])["faults"].clone();
    assert_eq!(list[0]["id"], "k");
    assert_eq!(list[0]["hits"], 1);
    assert_eq!(list[1]["phase"], "armed");
    // Clearing a kill restarts the robot.
    query(&lab, &["fault", "clear", "k"]);
    team.wait_for_row("events.csv", &[",joined,gold,", "incarnation 2"]);
    refused(
        &lab,
        &["fault", "clear", "k"],
        "alliance fault: the fault 'k' has already ended",
    );
    refused(
        &lab,
        &["fault", "kill", "glod"],
        "alliance fault: fault.kill: the scenario has no robot 'glod'; did you mean 'gold'? (there are blue, gold, green)",
    );
    refused(
        &lab,
        &["fault", "mute", "blue", "--id", "k"],
        "alliance fault: id: 'k' is already the id of another fault of this run; choose another id, or omit it",
    );
    let status = query(&lab, &["status"])["status"].clone();
    assert_eq!(status["robots"][1]["robot"], "gold");
    assert_eq!(status["robots"][1]["incarnation"], 2);
    assert_ne!(
        status["robots"][1]["pid"].as_u64(),
        Some(u64::from(team.pid("gold")))
    );
    query(&lab, &["clock", "speed", "max"]);
    team.wait().expect(0);

    let log = lab.log("run");
    let gone = events(&log, "gone", Some("gold"));
    assert_eq!(gone[0].t_ms, at(tick as f64 * 0.05));
    assert!(gone[0].detail.ends_with("last broadcasts not listed"));
    hit(&log, "f2");
    assert!(!log.run.unscripted);
    lab.run(&["replay", "run"]).expect(0);
    lab.run(&["fault", "list"]).expect(3);
}

#[test]
fn a_world_without_a_launcher_refuses_process_faults() {
    let lab = Lab::new();
    std::fs::write(
        lab.path("kills.toml"),
        "name = \"kills\"\n[[faults.timeline]]\nfault.kill = \"gold\"\n",
    )
    .unwrap();
    let finished = lab
        .run(&["cluster", "world", "kills.toml", "--out", "none"])
        .expect(2);
    assert_eq!(
        finished.stderr.trim_end(),
        "world: scenario 'kills': its fault 'kill gold' needs a launcher; start it with `alliance run`"
    );
    assert!(!lab.path("none").exists());
}

#[test]
fn faults_that_are_cleared_together_are_replayed_together() {
    let lab = Lab::new();
    let team = Team::start(&lab, &["--paused", "--speed", "max", "--limit", "60"]);
    crate::harness::wait_until("a live run", || lab.run(&["status"]).status.success());
    let step = |ticks: &str| {
        let until = query(&lab, &["status"])["status"]["tick"].as_u64().unwrap()
            + ticks.parse::<u64>().unwrap();
        query(&lab, &["clock", "step", ticks]);
        crate::harness::wait_until("the steps", || {
            query(&lab, &["status"])["status"]["tick"].as_u64() == Some(until)
        });
    };
    step("200");
    query(&lab, &["fault", "drop", "--p", "0.5"]);
    query(&lab, &["fault", "kill", "gold"]);
    step("100");
    query(&lab, &["fault", "remove", "green"]);
    step("100");
    let cleared = query(&lab, &["fault", "clear"])["cleared"].clone();
    assert_eq!(cleared["ids"], serde_json::json!(["f1", "f2", "f3"]));
    query(&lab, &["clock", "resume"]);
    team.wait().expect(1);

    let log = lab.log("run");
    let incarnations = |robot: &str| events(&log, "joined", Some(robot)).len();
    assert_eq!(
        (
            incarnations("blue"),
            incarnations("gold"),
            incarnations("green")
        ),
        (1, 2, 2)
    );
    assert_eq!(events(&log, "healed", None).len(), 3);
    let replay = lab.run(&["replay", "run"]).expect(0);
    assert!(
        replay.answer().starts_with("identical"),
        "{}",
        replay.stderr
    );
}
