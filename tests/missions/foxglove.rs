//! The channels of a live run for Foxglove are those of its MCAP file, and no client changes a byte of the run.

use std::net::{TcpListener, TcpStream};
use std::path::Path;

use alliance_tests::harness::{Lab, free_ports, wait_until};
use alliance_tests::observers::{assert_observer_can_die, facts};
use alliance_tests::python::python;
use alliance_tests::testkit::DEFAULT_HASH;
use nix::sys::signal::{Signal, kill};
use serde_json::{Value, json};

/// A day with a late robot, an obstacle and a dead sensor. The client kills gold.
const DAY: &str = r#"
robots = [
    { name = "blue", side_sensor = true },
    { name = "gold" },
    { name = "green" },
    { name = "red-2", absent = true },
]
[faults]
timeline = [
    { fault.add = "red-2", at_s = 5.0 },
    { fault.obstacle = { x_m = 6.0, y_m = 4.0, width_m = 0.5, height_m = 1.0 }, at_s = 8.0, for_s = 5.0 },
    { fault.drop = { p = 0.3 }, at_s = 4.0, for_s = 10.0 },
    { fault.sensor = { robot = "blue", device = "position", mode = "dead" }, at_s = 6.0, for_s = 5.0 },
]
"#;

#[track_caller]
fn connect(lab: &Lab, python: &Path, mode: &str, out: &str, arguments: &str) -> Value {
    facts(lab, python, "foxglove_client.py", &[mode], (out, arguments))
}

#[test]
fn a_client_receives_the_messages_of_the_recording_and_controls_the_run() {
    let Some(python) = python(&["websockets", "mcap"]) else {
        return;
    };
    let lab = Lab::new();
    lab.write("day.toml", DAY);
    // The script compares channels, all messages, their order, and those of a late client.
    let facts = connect(
        &lab,
        &python,
        "compare",
        "run",
        "day.toml --limit 30 --speed 5x",
    );
    let topics = &facts["topics"];
    assert_eq!(topics["/tf"], 601);
    assert_eq!(topics["/threshold"], 2);
    let events = lab.text("run/events.csv").lines().count() - 1;
    assert_eq!(topics["/events"], json!(events));
    assert_eq!(topics["/log"], json!(events));
    let capabilities = facts["info"]["capabilities"].as_array().unwrap();
    assert!(
        ["time", "services"]
            .iter()
            .all(|name| capabilities.contains(&json!(name)))
    );

    let answers = &facts["answers"];
    let refused = |call: &str| answers[call].as_str().unwrap().to_owned();
    assert!(
        refused("1").starts_with("not a control command: "),
        "{answers}"
    );
    assert!(refused("2").contains("nobody"), "{answers}");
    assert_eq!(answers["3"]["armed"]["tick"], 200);
    assert_eq!(answers["4"]["clock"]["paused"], false);
    assert!(lab.text("run/events.csv").contains(",gone,gold,"));
}

#[test]
fn clients_play_a_finished_run() {
    let Some(python) = python(&["websockets", "mcap"]) else {
        return;
    };
    let lab = Lab::new();
    lab.write("day.toml", DAY);
    // The script compares all messages of the playback, and the state after a jump, with the recording.
    let facts = connect(&lab, &python, "play", "run", "day.toml --limit 20");
    assert!(facts["messages"].as_u64() > Some(5000), "{facts}");
    let capabilities = facts["capabilities"].as_array().unwrap();
    assert!(capabilities.contains(&json!("playbackControl")), "{facts}");
}

#[test]
fn no_client_changes_a_byte_of_the_run() {
    let Some(python) = python(&["websockets", "mcap"]) else {
        return;
    };
    let lab = Lab::new();
    for mode in ["hostile", "slow"] {
        let facts = connect(&lab, &python, mode, mode, "--speed max");
        assert_eq!(
            lab.log(mode).run.hash.as_deref(),
            Some(DEFAULT_HASH),
            "{mode}"
        );
        if mode == "hostile" {
            assert!(facts["connections"].as_u64() > Some(0), "{facts}");
        }
    }
}

#[test]
fn a_run_continues_without_its_process_for_foxglove() {
    let lab = Lab::new();
    let port = free_ports(1)[0];
    let arguments = format!("run --no-page --out run --speed 20x --foxglove=127.0.0.1:{port}");
    let shown = format!("Foxglove ws://127.0.0.1:{port} (process ");
    assert_observer_can_die(&lab, &arguments, &shown, "Foxglove");
}

#[test]
fn a_process_that_is_too_late_says_so() {
    let lab = Lab::new();
    let port = free_ports(1)[0];
    let arguments = format!("run --no-page --out run --speed 40x --foxglove=127.0.0.1:{port}");
    let mut launcher = lab.start(&*arguments);
    let world = launcher.shown_pid("process ids: world ");
    let pid = launcher.shown_pid(&format!("Foxglove ws://127.0.0.1:{port} (process "));
    // It serves clients when it can handle signals.
    wait_until("server of the channels", || {
        TcpStream::connect(("127.0.0.1", port)).is_ok()
    });
    kill(pid, Signal::SIGSTOP).unwrap();
    // Until the launcher has seen the end of the world, it says that the run continues.
    wait_until("end of the world", || kill(world, None).is_err());
    // The launcher does the same after some seconds.
    kill(pid, Signal::SIGTERM).unwrap();
    kill(pid, Signal::SIGCONT).unwrap();
    let finished = launcher.wait().expect(0);
    finished.shows("the run was not published to Foxglove to its end:");
    finished.shows("the process was ended before it had published the whole run");
    assert_eq!(lab.log("run").run.hash.as_deref(), Some(DEFAULT_HASH));
}

#[test]
fn runs_that_foxglove_cannot_have_are_refused() {
    let lab = Lab::new();
    lab.write(
        "external.toml",
        r#"robots = [{ name = "a", controller = "mine" }]"#,
    );
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = listener.local_addr().unwrap().port();
    for (arguments, expected) in [
        (
            "run --foxglove=here".to_owned(),
            "alliance: invalid value 'here' for '--foxglove[=<ADDRESS>]': ".to_owned(),
        ),
        (
            format!("run --foxglove=127.0.0.1:{taken}"),
            format!(
                "alliance run: --foxglove 127.0.0.1:{taken}: Address already in use (os error 98); use a free address of this machine, such as 127.0.0.1:8766\n"
            ),
        ),
        (
            "run --foxglove=0.0.0.0:0 --foxglove-control".to_owned(),
            "alliance run: --foxglove-control: 0.0.0.0:0 accepts other machines, and clients need no password; use 127.0.0.1\n".to_owned(),
        ),
        (
            "run --foxglove-control".to_owned(),
            "alliance: the following required arguments were not provided: --foxglove[=<ADDRESS>]".to_owned(),
        ),
        (
            "run external.toml --controller mine=true --foxglove".to_owned(),
            "alliance run: --foxglove: the controller 'mine' is an external program; export the run afterwards".to_owned(),
        ),
        (
            "run --log summary --foxglove".to_owned(),
            "alliance run: --foxglove: the log is 'summary', and observers need one of every tick; add --log compact\n".to_owned(),
        ),
        (
            "run --in-process --foxglove".to_owned(),
            "alliance: the argument '--in-process' cannot be used with '--foxglove[=<ADDRESS>]'".to_owned(),
        ),
    ] {
        let refusal = lab.refusal(&*arguments);
        assert!(refusal.starts_with(&expected), "{arguments}: {refusal}");
    }
    assert!(!lab.exists("runs"));

    lab.mission("over", "--in-process --limit 1").expect(1);
    let refusal = lab.refusal(format!("watch over --foxglove=127.0.0.1:{taken}"));
    let expected = format!("alliance watch: 127.0.0.1:{taken}: Address already in use");
    assert!(refusal.starts_with(&expected), "{refusal}");
    drop(listener);
    let refusal = lab.refusal("cluster foxglove over --control over");
    let expected = "alliance cluster foxglove: --control: the run over is over and cannot be changed; leave it out\n";
    assert_eq!(refusal, expected);
    let refusal = lab.refusal("watch nowhere --foxglove");
    assert!(refusal.starts_with("alliance watch: nowhere"), "{refusal}");
}
