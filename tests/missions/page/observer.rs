//! A live run with its page: the frames of the page, and that a page never changes the run.

use std::collections::BTreeSet;

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::team::Team;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use run_log::EventRow;
use serde_json::{Value, json};

use super::client::{Page, watch};

#[test]
fn a_page_never_changes_a_byte_of_the_run() {
    let lab = Lab::new();
    let arguments = "--limit 120 --seed 5";
    lab.mission("without", arguments).expect(1);

    let mut team = Team::start_with_page(&lab, format!("{arguments} --speed 20x"));
    let (page, server) = Page::of(&mut team);
    // Pages come and go. Two of them never read, and one pauses and resumes the run.
    let silent = [page.live(), page.live()];
    for _ in 0..20 {
        let mut stream = page.live();
        assert!(stream.wait_for("past")["views"].is_array());
    }
    let mut stream = page.live();
    stream.wait_for_view(|view| view["tick"].as_u64() > Some(0));
    page.control(r#"{"clock": "pause"}"#);
    stream.wait_for_view(|view| view["clock"]["paused"] == true);
    page.control(r#"{"clock": "resume"}"#);
    stream.wait_for_view(|view| view["clock"]["paused"] == false);

    kill(Pid::from_raw(server as i32), Signal::SIGKILL).unwrap();
    wait_until("the end of the page", || command_line(server).is_none());
    while stream.next().is_some() {}
    drop(silent);
    // `alliance watch` can serve further pages.
    for _ in 0..2 {
        let (process, page) = watch(&lab, "");
        page.live().wait_for("view");
        process.signal(Signal::SIGINT);
        process.wait().expect(0);
    }
    team.wait_for_stderr("the page was killed by SIGKILL; the run continues");
    team.wait().expect(1);
    lab.assert_same_bytes("without", "run");
}

#[test]
fn a_page_receives_all_events_messages_and_the_end_of_the_run() {
    let lab = Lab::new();
    let mut team = Team::start_with_page(&lab, "--paused --speed max --limit 90");
    let (page, _) = Page::of(&mut team);
    let about = page.get("/api/run");
    for (key, expected) in [
        ("/mode", json!("live")),
        ("/seed", json!(1)),
        ("/scenario/robots/1/name", json!("gold")),
        ("/alliance/threshold", json!(100.0)),
        ("/catalog/sets/2/name", json!("move-spill(top)")),
        ("/catalog/sets/2/task", json!(1)),
    ] {
        assert_eq!(about.pointer(key), Some(&expected), "{key}");
    }

    let mut stream = page.live();
    let nothing = json!({"receptions": [], "left_out": 0});
    let views = page.live().wait_for("past")["views"].clone();
    let past = json!({"views": views, "messages": nothing, "events": [], "corners": []});
    assert_eq!(stream.wait_for("past"), past);
    let view = stream.wait_for_view(|view| !view["robots"][0]["pid"].is_null());
    assert_eq!(
        (&view["tick"], &view["clock"]["paused"]),
        (&json!(0), &json!(true))
    );
    assert_eq!(view["items"].as_array().unwrap().len(), 24);

    // A step of one tick.
    page.control(r#"{"clock": {"step": 1}}"#);
    let view = stream.wait_for_view(|view| view["tick"] != 0);
    assert_eq!(
        (&view["tick"], &view["clock"]["steps_left"]),
        (&json!(1), &json!(0))
    );
    assert_eq!(view["robots"][0]["sets"].as_array().unwrap().len(), 5);
    // An obstacle and its removal take effect while the clock is paused.
    let obstacle = r#"{"fault": {"fault": {"obstacle": {"x_m": 5, "y_m": 4, "width_m": 0.5, "height_m": 1}}}}"#;
    let armed = page.control(obstacle);
    let view = stream.wait_for_view(|view| view["obstacles"] != json!([]));
    assert_eq!(view["tick"], armed["armed"]["tick"]);
    assert_eq!(view["faults"][0]["phase"], "in-force");
    page.control(r#"{"clear": "f1"}"#);
    stream.wait_for_view(|view| view["obstacles"] == json!([]));

    page.control(r#"{"clock": {"speed": 20}}"#);
    page.control(r#"{"clock": "resume"}"#);
    let (mut received, mut deliveries) = (Vec::new(), BTreeSet::new());
    let ended = loop {
        let mut frame = stream.next().unwrap();
        if let Some(Value::Array(events)) = frame.get_mut("events") {
            received.append(events);
        }
        if let Some(messages) = frame.get("messages") {
            assert_eq!(messages["left_out"], 0);
            let receptions = messages["receptions"].as_array().unwrap().iter();
            let kinds = receptions.map(|message| message["reception"]["delivery"].to_string());
            deliveries.extend(kinds);
        }
        assert_eq!(frame.get("missed"), None);
        if let Some(ended) = frame.get("ended") {
            break ended.clone();
        }
    };
    assert_eq!(ended["outcome"], "time-limit");
    assert_eq!(ended["folder"], lab.path("run").to_str().unwrap());
    assert!(stream.next().is_none());
    assert!(deliveries.contains("\"Received\""), "{deliveries:?}");
    team.wait().expect(1);

    // The events are those of the log, complete and in order.
    let rows = lab.log("run").rows::<EventRow>().unwrap().into_iter();
    let logged = rows.map(|row| {
        json!({"t_ms": row.t_ms, "kind": row.kind, "robot": row.robot, "subject": row.subject, "reason": row.reason, "detail": row.detail})
    });
    let logged: Vec<Value> = logged.collect();
    let (earlier, later) = logged.split_at(logged.len() - received.len());
    assert_eq!(received, later);
    // Earlier events are in the past frame, or there was none yet.
    assert!(earlier.iter().all(|event| event["t_ms"] == 0));
}

/// The server stays until a slow browser has read all frames.
#[test]
fn a_page_that_reads_late_still_receives_the_end_of_the_run() {
    let lab = Lab::new();
    let mut team = Team::start_with_page(&lab, "--paused --speed max --limit 10");
    let (page, server) = Page::of(&mut team);
    let world = team.pid("world");
    let mut stream = page.live();
    page.control(r#"{"clock": "resume"}"#);

    wait_until("the end of the world", || command_line(world).is_none());
    let stays = command_line(server).is_some();
    assert!(stays, "the frames have not been read yet");
    assert_eq!(stream.wait_for("ended")["outcome"], "time-limit");
    assert!(stream.next().is_none());
    wait_until("the end of the server", || command_line(server).is_none());
    team.wait().expect(1);
}
