//! The control topic from outside: a program in Python, with zenoh's own package, breaks things in a live run.

use serde_json::{Value, json};

use crate::harness::Lab;
use crate::python::{python, run};
use crate::team::Team;

#[test]
fn a_foreign_program_breaks_things_and_what_is_refused_changes_nothing() {
    let Some(python) = python(&["zenoh"]) else {
        return;
    };
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "2x", "--limit", "60"]);
    team.wait_for_row("events.csv", &[",activated,"]);
    let said = run(&lab, &python, "mission.py", &[]);
    // The example of the documentation, as anybody would use it.
    let list = run(&lab, &python, "control.py", &[r#""list""#]);
    run(
        &lab,
        &python,
        "control.py",
        &[r#"{"clock": {"speed": null}}"#],
    );
    let resumed = run(&lab, &python, "control.py", &[r#"{"clock": "resume"}"#]);
    let finished = team.wait().expect(1);

    let replies: Vec<Value> = said
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let reply = |what: &str| {
        let found = replies.iter().find_map(|reply| reply.get(what));
        found.unwrap_or_else(|| panic!("no '{what}' in {said}"))
    };
    assert_eq!(reply("paused")["clock"]["paused"], true);
    let kill = &reply("kill")["armed"];
    let (id, tick) = (kill["id"].as_str().unwrap(), kill["tick"].as_u64().unwrap());
    assert_eq!(kill["t_ms"], json!(50 * tick));

    // What has a seal is refused with a sealed reply, what has none with an error.
    let refused = |what: &str| reply(what)["reply"]["refused"].as_str().unwrap();
    let error = |what: &str| reply(what)["error"].as_str().unwrap();
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
    for what in ["wrong seal", "stranger"] {
        assert!(error(what).starts_with("wrong seal; "), "{}", error(what));
    }
    assert!(error("no encoding").ends_with("send JSON with the encoding application/json"));

    // Two orders were obeyed, whoever asks.
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

    // The log tells of these two and of nothing else.
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
    let deaf = std::fs::read_to_string(lab.path("run").join("messages.csv")).unwrap();
    let dropped = |line: &&str| line.ends_with(",dropped");
    assert!(
        deaf.lines().any(|line| dropped(&line)),
        "the drop never hit"
    );
    assert!(
        deaf.lines()
            .filter(dropped)
            .all(|line| line.split(',').nth(1) == Some("blue"))
    );
    assert_eq!(finished.json()["unscripted"], false);
    // Eight queries and two puts.
    assert_eq!(finished.json()["host"]["refused"]["control"], 10);
}
