//! A live run with its page: the frames of the page, and that a page never changes the run.

use std::collections::BTreeSet;

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::team::Team;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};

use super::client::Page;

#[test]
fn a_page_never_changes_a_byte_of_the_run() {
    let lab = Lab::new();
    let arguments = ["--limit", "120", "--seed", "5"];
    lab.mission("without", &arguments).expect(1);

    let paced = [arguments.as_slice(), &["--speed", "20x"]].concat();
    let mut team = Team::start_with_page(&lab, &paced);
    let pid = team.wait_for_page();
    let page = Page::from_output(&team.launcher().stderr());
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

    kill(Pid::from_raw(pid as i32), Signal::SIGKILL).unwrap();
    wait_until("the end of the page", || command_line(pid).is_none());
    while stream.next().is_some() {}
    drop(silent);
    // `alliance watch` can serve further pages.
    for _ in 0..2 {
        let mut watch = lab.start(&["watch"]);
        watch.wait_for_stderr("/#");
        let mut stream = Page::from_output(&watch.stderr()).live();
        stream.wait_for("view");
        watch.signal(Signal::SIGINT);
        watch.wait().expect(0);
    }
    let stderr = team.launcher().stderr();
    assert!(
        stderr.contains("the page was killed by SIGKILL; the run continues"),
        "{stderr}"
    );
    team.wait().expect(1);
    lab.assert_same_bytes("without", "run");
}

#[test]
fn a_page_receives_all_events_messages_and_the_end_of_the_run() {
    let lab = Lab::new();
    let mut team = Team::start_with_page(&lab, &["--paused", "--speed", "max", "--limit", "90"]);
    team.wait_for_page();
    let page = Page::from_output(&team.launcher().stderr());

    let about = page.get("/api/run");
    assert_eq!(
        (&about["mode"], &about["seed"]),
        (&json!("live"), &json!(1))
    );
    assert_eq!(about["scenario"]["robots"][1]["name"], "gold");
    assert_eq!(about["alliance"]["threshold"], 100.0);
    assert_eq!(about["catalog"]["sets"][2]["name"], "move-spill(top)");
    assert_eq!(about["catalog"]["sets"][2]["task"], 1);

    let mut stream = page.live();
    assert_eq!(
        stream.wait_for("past"),
        json!({"views": past_views(&page), "messages": {"receptions": [], "left_out": 0}, "events": [], "corners": []})
    );
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
    let mut received: Vec<Value> = Vec::new();
    let mut deliveries = BTreeSet::new();
    let ended = loop {
        let frame = stream.next().unwrap();
        if let Some(Value::Array(events)) = frame.get("events") {
            received.extend_from_slice(events);
        }
        if let Some(messages) = frame.get("messages") {
            assert_eq!(messages["left_out"], 0);
            for message in messages["receptions"].as_array().unwrap() {
                deliveries.insert(
                    message["reception"]["delivery"]
                        .as_str()
                        .unwrap()
                        .to_owned(),
                );
            }
        }
        assert_eq!(frame.get("missed"), None);
        if let Some(ended) = frame.get("ended") {
            break ended.clone();
        }
    };
    assert_eq!(ended["outcome"], "time-limit");
    assert_eq!(ended["folder"], lab.path("run").to_str().unwrap());
    assert!(stream.next().is_none());
    assert!(deliveries.contains("Received"), "{deliveries:?}");
    team.wait().expect(1);

    // The events are those of the log, complete and in order.
    let logged: Vec<Value> = lab
        .log("run")
        .each_row::<run_log::EventRow>()
        .map(|row| {
            let row = row.unwrap();
            json!({"t_ms": row.t_ms, "kind": row.kind, "robot": row.robot, "subject": row.subject, "reason": row.reason, "detail": row.detail})
        })
        .collect();
    let from = logged.len() - received.len();
    assert_eq!(received, logged[from..]);
    // Earlier events are in the past frame, or there was none yet.
    assert!(logged[..from].iter().all(|event| event["t_ms"] == 0));
}

/// The server stays until a slow browser has read all frames.
#[test]
fn a_page_that_reads_late_still_receives_the_end_of_the_run() {
    let lab = Lab::new();
    let mut team = Team::start_with_page(&lab, &["--paused", "--speed", "max", "--limit", "10"]);
    let server = team.wait_for_page();
    let world = team.pid("world");
    let page = Page::from_output(&team.launcher().stderr());
    let mut stream = page.live();
    page.control(r#"{"clock": "resume"}"#);

    wait_until("the end of the world", || command_line(world).is_none());
    assert!(
        command_line(server).is_some(),
        "the frames have not been read yet"
    );
    assert_eq!(stream.wait_for("ended")["outcome"], "time-limit");
    assert!(stream.next().is_none());
    wait_until("the end of the server", || command_line(server).is_none());
    team.wait().expect(1);
}

/// Returns the views in the past frame of a run at its beginning.
fn past_views(page: &Page) -> Value {
    page.live().wait_for("past")["views"].clone()
}
