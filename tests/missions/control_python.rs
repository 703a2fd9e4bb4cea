//! A Python program with the zenoh package sends orders to a live run.

use alliance_tests::harness::Lab;
use alliance_tests::python::{python, run};
use alliance_tests::team::Team;
use serde_json::{Value, json};

#[test]
fn an_external_program_sends_orders_and_refused_requests_change_nothing() {
    let Some(python) = python(&["zenoh"]) else {
        return;
    };
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "2x", "--limit", "60"]);
    team.wait_for_row("events.csv", &[",activated,"]);
    let output = run(&lab, &python, "mission.py", &[]);
    // The example of the documentation, unchanged.
    let list = run(&lab, &python, "control.py", &[r#""list""#]);
    run(
        &lab,
        &python,
        "control.py",
        &[r#"{"clock": {"speed": null}}"#],
    );
    let resumed = run(&lab, &python, "control.py", &[r#"{"clock": "resume"}"#]);
    let finished = team.wait().expect(1);

    let replies: Vec<Value> = output
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
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
    let error = |key: &str| reply(key)["error"].as_str().unwrap();
    assert!(!refused("replayed").is_empty());
    assert_eq!(
        refused("misspelled"),
        "fault.kill: the scenario has no robot 'glod'; did you mean 'gold'? (there are blue, gold, green)"
    );
    let unknown = "malformed JSON: unknown variant `dance`, expected one of `fault`, `clear`, `list`, `status`, `describe`, `clock`";
    assert!(
        error("malformed").starts_with(unknown),
        "{}",
        error("malformed")
    );
    assert!(error("cut").starts_with("malformed JSON: EOF while parsing"));
    assert!(error("no seal").starts_with("no seal; "));
    for key in ["wrong seal", "stranger"] {
        assert!(error(key).starts_with("wrong seal; "), "{}", error(key));
    }
    assert!(error("no encoding").ends_with("send JSON with the encoding application/json"));

    // Exactly two orders took effect.
    let faults = reply("list")["faults"].as_array().unwrap();
    let orders: Vec<(&str, &Value)> = faults
        .iter()
        .map(|fault| (fault["id"].as_str().unwrap(), &fault["order"]["fault"]))
        .collect();
    let drop = json!({"drop": {"from": "all", "to": "blue", "p": 1.0, "burst_s": 0.0}});
    assert_eq!(
        orders,
        [(id, &json!({"kill": "gold"})), ("deaf-blue", &drop)]
    );
    let list: Value = serde_json::from_str(&list).unwrap();
    assert_eq!(list["faults"].as_array().unwrap().len(), 2);

    let status = &reply("status")["status"];
    let robots = status["robots"].as_array().unwrap();
    let state = |rank: usize| {
        (
            robots[rank]["robot"].as_str(),
            robots[rank]["state"].as_str(),
        )
    };
    assert_eq!(state(0), (Some("blue"), Some("present")));
    assert_eq!(state(1), (Some("gold"), Some("dead")));
    assert_eq!(status["clock"]["paused"], true);
    let resumed: Value = serde_json::from_str(&resumed).unwrap();
    assert_eq!(resumed["clock"]["paused"], false);

    // The log contains these two orders and no others.
    let events = std::fs::read_to_string(lab.path("run").join("events.csv")).unwrap();
    let armed: Vec<&str> = events
        .lines()
        .filter(|line| line.split(',').nth(1) == Some("armed"))
        .collect();
    assert_eq!(armed.len(), 2, "{armed:?}");
    assert!(
        armed[0].contains(id) && armed[1].contains("deaf-blue"),
        "{armed:?}"
    );
    let deaths: Vec<&str> = events
        .lines()
        .filter(|line| line.split(',').nth(1) == Some("gone"))
        .collect();
    assert_eq!(deaths.len(), 1, "{deaths:?}");
    assert!(
        deaths[0].starts_with(&format!("{},gone,gold,", 50 * tick)),
        "{deaths:?}"
    );
    let messages = std::fs::read_to_string(lab.path("run").join("messages.csv")).unwrap();
    let dropped = |line: &&str| line.ends_with(",dropped");
    assert!(
        messages.lines().any(|line| dropped(&line)),
        "the drop had no effect"
    );
    assert!(
        messages
            .lines()
            .filter(dropped)
            .all(|line| line.split(',').nth(1) == Some("blue"))
    );
    assert_eq!(finished.json()["unscripted"], false);
    // The refused requests: eight queries and two puts.
    assert_eq!(finished.json()["host"]["refused"]["control"], 10);
}
