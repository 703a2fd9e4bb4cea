//! The topics of a live run in ROS 2 are those of its bag, and nothing in ROS changes a byte of the run.

use std::path::Path;

use alliance_tests::harness::Lab;
use alliance_tests::observers::{assert_observer_can_die, facts};
use alliance_tests::python::python;
use alliance_tests::testkit::DEFAULT_HASH;
use serde_json::{Value, json};

/// A day with a late robot, a crash, an obstacle and a dead sensor, and with a name that ROS does not accept.
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
    { fault.kill = "gold", at_s = 10.0, for_s = 5.0 },
    { fault.obstacle = { x_m = 6.0, y_m = 4.0, width_m = 0.5, height_m = 1.0 }, at_s = 8.0, for_s = 5.0 },
    { fault.drop = { p = 0.3 }, at_s = 4.0, for_s = 10.0 },
    { fault.sensor = { robot = "blue", device = "position", mode = "dead" }, at_s = 6.0, for_s = 5.0 },
]
"#;

#[track_caller]
fn subscribe(lab: &Lab, python: &Path, mode: &str, out: &str, arguments: &str) -> Value {
    facts(lab, python, "ros_topics.py", &[mode, "7"], (out, arguments))
}

#[test]
fn a_subscriber_receives_the_messages_of_the_bag() {
    let Some(python) = python(&["zenoh", "rosbags", "xxhash"]) else {
        return;
    };
    let lab = Lab::new();
    lab.write("day.toml", DAY);
    // The script compares keys, tokens, attachments and all messages, also those of a late subscriber.
    let arguments = "day.toml --limit 30 --speed 5x";
    let topics = &subscribe(&lab, &python, "compare", "run", arguments)["topics"];
    assert_eq!(topics["/clock"], 601);
    assert_eq!(topics["/tf"], 601);
    assert_eq!(topics["/map"], 3);
    assert_eq!(topics["/blue/odom"], 500);
    assert!(topics["/red_2/odom"].as_u64() > Some(300));
    let events = lab.text("run/events.csv").lines().count() - 1;
    assert_eq!(topics["/alliance/events"], json!(events));
}

#[test]
fn no_subscriber_changes_a_byte_of_the_run() {
    let Some(python) = python(&["zenoh", "rosbags", "xxhash"]) else {
        return;
    };
    let lab = Lab::new();
    for mode in ["hostile", "stopped"] {
        subscribe(&lab, &python, mode, mode, "--speed max");
        assert_eq!(
            lab.log(mode).run.hash.as_deref(),
            Some(DEFAULT_HASH),
            "{mode}"
        );
    }
}

/// A client by others calls the services. The run is that of the same orders on the control topic, and replays.
#[test]
fn nodes_of_ros_control_a_run_on_request() {
    let Some(python) = python(&["zenoh", "rosbags", "zenoh_ros2_sdk"]) else {
        return;
    };
    let lab = Lab::new();
    lab.write(
        "two.toml",
        "robots = [{ name = \"blue\" }, { name = \"gold\" }]",
    );
    let arguments = ("run", "two.toml --limit 5 --speed 5x");
    let found = facts(&lab, &python, "ros_services.py", &["7"], arguments);
    let expected = json!([
        "/alliance/pause",
        "/alliance/resume",
        "/alliance/step",
        "/blue/kill",
        "/blue/restart",
        "/gold/kill",
        "/gold/restart",
    ]);
    assert_eq!(found["services"], expected);
    for service in ["step", "kill", "resume"] {
        assert_eq!(found[service][0], true, "{found}");
    }
    let reply: Value = serde_json::from_str(found["kill"][1].as_str().unwrap()).unwrap();
    assert_eq!(reply["armed"]["tick"], 1, "{reply}");
    assert_eq!(found["armed"]["armed"]["t_ms"], 3000, "{found}");
    let refused = found["refused"]["refused"].as_str();
    assert!(
        refused.is_some_and(|why| why.contains("'nobody'")),
        "{found}"
    );
    lab.assert_repeated("run");
}

#[test]
fn a_run_continues_without_its_process_for_ros() {
    let lab = Lab::new();
    let arguments = "run --no-page --out run --speed 20x --ros --ros-router tcp/127.0.0.1:9";
    let shown = "ROS 2 domain 0, router tcp/127.0.0.1:9 (process ";
    assert_observer_can_die(&lab, arguments, shown, "ROS");
}

#[test]
fn a_missing_router_is_named_at_the_end() {
    let lab = Lab::new();
    let arguments = "--limit 5 --speed max --ros --ros-router tcp/127.0.0.1:9";
    let finished = lab.mission("run", arguments).expect(1);
    finished
        .shows("no zenoh router has answered at tcp/127.0.0.1:9; start `ros2 run rmw_zenoh_cpp");
}

#[test]
fn runs_that_ros_cannot_have_are_refused() {
    let lab = Lab::new();
    lab.write(
        "names.toml",
        r#"robots = [{ name = "r-2" }, { name = "r_2" }]"#,
    );
    lab.write(
        "external.toml",
        r#"robots = [{ name = "a", controller = "mine" }]"#,
    );
    for (arguments, expected) in [
        (
            "run --ros=233",
            "alliance: invalid value '233' for '--ros[=<DOMAIN>]': 233 is not from 0 to 232; try --help\n",
        ),
        (
            "run --ros --ros-router udp/127.0.0.1:7447",
            "alliance: invalid value 'udp/127.0.0.1:7447' for '--ros-router <LOCATOR>': 'udp/127.0.0.1:7447' is not a network address; use tcp/ADDRESS:PORT, such as tcp/127.0.0.1:7447",
        ),
        (
            "run --ros --ros-router tls/127.0.0.1:7447",
            "alliance: invalid value 'tls/127.0.0.1:7447' for '--ros-router <LOCATOR>': 'tls/127.0.0.1:7447' needs certificates; use tcp/ADDRESS:PORT",
        ),
        (
            "run names.toml --ros",
            "alliance run: --ros: robots 'r-2' and 'r_2' have the same ROS name 'r_2'; rename the robot",
        ),
        (
            "run external.toml --controller mine=true --ros",
            "alliance run: --ros: the controller 'mine' is an external program; export the run afterwards",
        ),
        (
            "run --log summary --ros",
            "alliance run: --ros: the log is 'summary', and observers need one of every tick; add --log compact\n",
        ),
        (
            "run --in-process --ros",
            "alliance: the argument '--in-process' cannot be used with '--ros[=<DOMAIN>]'",
        ),
    ] {
        let refusal = lab.refusal(arguments);
        assert!(refusal.starts_with(expected), "{arguments}: {refusal}");
    }
    assert!(!lab.exists("runs"));

    lab.mission("over", "--in-process --limit 1").expect(1);
    let refusal = lab.refusal("cluster ros over");
    let expected = "alliance cluster ros: over: the run is over; use `alliance export`\n";
    assert_eq!(refusal, expected);
    let refusal = lab.refusal("cluster ros nowhere");
    let expected =
        "alliance cluster ros: nowhere is not the folder of a run: there is no such folder\n";
    assert_eq!(refusal, expected);
}
