//! A Python program with the zenoh package sends orders to a live run.

use std::collections::BTreeSet;

use alliance_tests::harness::Lab;
use alliance_tests::python::{python, run};
use alliance_tests::runs::Events;
use alliance_tests::team::Team;
use run_log::MessageRow;
use serde_json::{Value, json};

#[test]
fn an_external_program_sends_orders_and_refused_requests_change_nothing() {
    let Some(python) = python(&["zenoh"]) else {
        return;
    };
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 2x --limit 60");
    team.wait_for_row("events.csv", &[",activated,"]);
    let output = run(&lab, &python, "mission.py", &[]);
    // The example of the documentation, unchanged.
    let control = |command: &str| -> Value {
        let answer = run(&lab, &python, "control.py", &[command]);
        serde_json::from_str(&answer).unwrap()
    };
    let list = control(r#""list""#);
    control(r#"{"clock": {"speed": null}}"#);
    let resumed = control(r#"{"clock": "resume"}"#);
    let finished = team.wait().expect(1).json();

    let replies = output.lines().map(serde_json::from_str);
    let replies: Vec<Value> = replies.map(Result::unwrap).collect();
    let reply = |key: &str| {
        let found = replies.iter().find_map(|reply| reply.get(key));
        found.unwrap_or_else(|| panic!("no '{key}' in {output}"))
    };
    assert_eq!(reply("paused")["clock"]["paused"], true);
    let kill = &reply("kill")["armed"];
    let (id, tick) = (kill["id"].as_str().unwrap(), kill["tick"].as_u64().unwrap());
    assert_eq!(kill["t_ms"], json!(50 * tick));

    // A sealed request is refused with a sealed reply, a request without a seal with an error.
    let refused = |key: &str| reply(key)["reply"]["refused"].as_str().unwrap();
    assert!(!refused("replayed").is_empty());
    assert_eq!(
        refused("misspelled"),
        "fault.kill: the scenario has no robot 'glod'; did you mean 'gold'? (there are blue, gold, green)"
    );
    let commands = "`fault`, `clear`, `list`, `status`, `describe`, `clock`";
    let unknown = format!("malformed JSON: unknown variant `dance`, expected one of {commands}");
    for (key, start) in [
        ("malformed", unknown.as_str()),
        ("cut", "malformed JSON: EOF while parsing"),
        ("no seal", "no seal; "),
        ("wrong seal", "wrong seal; "),
        ("stranger", "wrong seal; "),
    ] {
        let error = reply(key)["error"].as_str().unwrap();
        assert!(error.starts_with(start), "{key}: {error}");
    }
    let error = reply("no encoding")["error"].as_str().unwrap();
    assert!(error.ends_with("send JSON with the encoding application/json"));

    // Exactly two orders took effect.
    let faults = reply("list")["faults"].as_array().unwrap().iter();
    let orders: Vec<_> = faults
        .map(|fault| (&fault["id"], &fault["order"]["fault"]))
        .collect();
    let drop = json!({"drop": {"from": "all", "to": "blue", "p": 1.0, "burst_s": 0.0}});
    let kill = json!({"kill": "gold"});
    let expected = [(&json!(id), &kill), (&json!("deaf-blue"), &drop)];
    assert_eq!(orders, expected);
    assert_eq!(list["faults"].as_array().unwrap().len(), 2);

    let status = &reply("status")["status"];
    for (rank, robot, state) in [(0, "blue", "present"), (1, "gold", "dead")] {
        let robots = &status["robots"][rank];
        assert_eq!(
            (&robots["robot"], &robots["state"]),
            (&json!(robot), &json!(state))
        );
    }
    assert_eq!(status["clock"]["paused"], true);
    assert_eq!(resumed["clock"]["paused"], false);

    // The log contains these two orders and no others.
    let log = lab.log("run");
    let armed = log.events("armed");
    let armed: Vec<&str> = armed.iter().map(|row| row.subject.as_str()).collect();
    assert_eq!(armed, [id, "deaf-blue"]);
    assert_eq!(log.events("gone").len(), 1);
    assert_eq!(log.times_of("gold", "gone"), [50 * tick]);
    let rows = log.rows::<MessageRow>().unwrap();
    let dropped = rows.iter().filter(|row| row.delivery == "dropped");
    let deaf: BTreeSet<&str> = dropped.map(|row| row.receiver.as_str()).collect();
    assert_eq!(deaf, BTreeSet::from(["blue"]), "only blue loses messages");
    assert_eq!(finished["unscripted"], false);
    // The refused requests: eight queries and two puts.
    assert_eq!(finished["host"]["refused"]["control"], 10);
}
