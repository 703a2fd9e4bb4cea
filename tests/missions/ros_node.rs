//! A robot whose controller is a node of ROS 2, written with packages by others: it works, its run replays without it, and
//! nothing but a valid command has an effect.

use std::fs;
use std::path::Path;

use alliance_tests::harness::Lab;
use alliance_tests::observers::facts;
use alliance_tests::python::python;
use alliance_tests::runs::Events;
use run_log::PoseRow;
use serde_json::Value;

/// Two robots carry the items of one spill each. The node controls blue-1, which has another name in ROS.
const CREW: &str = r#"
name = "crew"
limit_s = 120
room = { width_m = 6, height_m = 4 }

[waste]
border_known = true
spill_radius_m = 0.4
deposit = { radius_m = 0.6, x_fraction = 0.5, y_fraction = 0.5 }

[[waste.spills]]
name = "left"
items = 2
x_fraction = 0.15
y_fraction = 0.5

[[waste.spills]]
name = "right"
items = 2
x_fraction = 0.85
y_fraction = 0.5

[[robots]]
name = "blue-1"
tasks = ["move-spill(left)"]
controller = "nav"

[[robots]]
name = "gold"
tasks = ["move-spill(right)"]
"#;

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("crew.toml", CREW);
    lab
}

/// Runs the scenario with the node in this mode, in the folder of that name.
#[track_caller]
fn control(lab: &Lab, python: &Path, mode: &str, arguments: &str) -> Value {
    let arguments = format!("crew.toml --log full {arguments}");
    // Each run of a mode begins anew.
    let _ = fs::remove_dir_all(lab.path(mode));
    facts(lab, python, "ros_node.py", &[mode, "7"], (mode, &arguments))
}

#[test]
fn a_node_does_the_work_of_a_robot_and_garbage_changes_only_counts() {
    let Some(python) = python(&["zenoh", "rosbags", "xxhash", "jsonschema"]) else {
        return;
    };
    let lab = lab();
    let facts = control(&lab, &python, "drive", "");
    let log = lab.log("drive");
    assert_eq!(lab.json("drive/run.json")["outcome"], "complete");
    assert_eq!(log.events_of("blue-1", "delivered").len(), 2);
    assert_eq!(facts["delivered"], 2);
    assert_eq!(facts["ticks"], log.run.result.ticks);
    for topic in ["clock", "blue_1/odom", "blue_1/scan", "blue_1/devices"] {
        assert_eq!(facts["topics"][topic], facts["ticks"], "{topic}");
    }
    let endpoints = facts["endpoints"].as_array().unwrap();
    for endpoint in [
        "MS /blue_1/cmd_vel geometry_msgs::msg::dds_::TwistStamped_",
        "MS /blue_1/action std_msgs::msg::dds_::String_",
        "MP /clock rosgraph_msgs::msg::dds_::Clock_",
    ] {
        assert!(endpoints.iter().any(|known| known == endpoint), "{facts}");
    }
    lab.assert_repeated("drive");

    control(&lab, &python, "hostile", "");
    assert_eq!(lab.log("hostile").run.hash, log.run.hash);
    lab.assert_same_bytes("drive", "hostile");
    let agent_log = lab.text("hostile/logs/blue-1.log");
    for kind in [
        "attachment",
        "encoding",
        "size",
        "number",
        "frame",
        "late",
        "early",
        "type",
        "action",
    ] {
        // One line for the first message, and one for the number of all.
        let lines = agent_log.matches(&format!("kind=\"{kind}\"")).count();
        assert_eq!(lines, 2, "{kind}: {agent_log}");
    }
}

#[test]
fn faults_reach_the_robot_of_a_node_and_the_run_is_repeatable() {
    let Some(python) = python(&["zenoh", "rosbags", "xxhash", "jsonschema"]) else {
        return;
    };
    let lab = Lab::new();
    let faults = r#"
        [faults]
        timeline = [
            { fault.pause = "blue-1", at_s = 5.0, for_s = 2.0 },
            { fault.kill = "blue-1", at_s = 12.0, for_s = 3.0 },
            { fault.drop.p = 0.4, at_s = 2.0 },
            { fault.sensor = { robot = "blue-1", device = "avoidance", mode = "dead" }, at_s = 20.0, for_s = 3.0 },
        ]
    "#;
    lab.write("crew.toml", format!("{CREW}{faults}"));
    let hashes = [(); 2].map(|()| {
        let facts = control(&lab, &python, "drive", "");
        let log = lab.log("drive");
        assert!(log.run.faults.iter().all(|fault| fault.hits > 0));
        assert_eq!(log.events_of("blue-1", "delivered").len(), 2);
        // A dead device publishes nothing for 3 s.
        let count = |topic: &str| facts["topics"][topic].as_u64().unwrap();
        assert_eq!(count("blue_1/devices") - count("blue_1/scan"), 60);
        lab.assert_repeated("drive");
        log.run.hash
    });
    assert!(hashes[0].is_some());
    assert_eq!(hashes[0], hashes[1]);
}

#[test]
fn the_robot_of_a_silent_node_stands_and_the_team_continues() {
    let Some(python) = python(&["zenoh", "rosbags", "xxhash", "jsonschema"]) else {
        return;
    };
    let lab = lab();
    let facts = control(&lab, &python, "silent", "--limit 60");
    assert_eq!(facts["ticks"], 100);
    let log = lab.log("silent");
    assert_eq!(log.events_of("gold", "delivered").len(), 2);
    assert!(log.events_of("blue-1", "stalled").is_empty());
    let mut rows = log.rows::<PoseRow>().unwrap();
    rows.retain(|row| row.robot == "blue-1");
    let has_moved = |row: &PoseRow| row.speed_m_s != 0.0;
    assert!(rows.iter().any(has_moved));
    // The motion of a tick shows in the next row.
    assert!(!rows.iter().filter(|row| row.t_ms.0 > 5100).any(has_moved));
    let agent_log = lab.text("silent/logs/blue-1.log");
    assert_eq!(agent_log.matches("no command in time").count(), 1);
    lab.assert_repeated("silent");
}

#[test]
fn commands_without_stamps_move_a_robot_and_the_run_replays() {
    let Some(python) = python(&["zenoh", "rosbags", "xxhash", "jsonschema"]) else {
        return;
    };
    let lab = lab();
    let facts = control(&lab, &python, "latest", "--speed 1x --limit 10");
    assert!(facts["ticks"].as_u64() > Some(100), "{facts}");
    let log = lab.log("latest");
    let mut rows = log.rows::<PoseRow>().unwrap();
    rows.retain(|row| row.robot == "blue-1" && row.speed_m_s > 0.0);
    assert!(!rows.is_empty());
    lab.assert_repeated("latest");
}

#[test]
fn the_time_continues_whichever_agent_ends() {
    let Some(python) = python(&["zenoh", "rosbags", "xxhash", "jsonschema"]) else {
        return;
    };
    let lab = Lab::new();
    let crew = CREW.replace(
        r#"tasks = ["move-spill(right)"]"#,
        "tasks = [\"move-spill(right)\"]\ncontroller = \"nav\"",
    );
    // Each agent is gone once, so the one that publishes the time is, too.
    let faults = r#"
        [faults]
        timeline = [
            { fault.kill = "blue-1", at_s = 3.0, for_s = 4.0 },
            { fault.kill = "gold", at_s = 11.0, for_s = 4.0 },
        ]
    "#;
    lab.write("crew.toml", format!("{crew}{faults}"));
    let facts = control(&lab, &python, "clock", "--speed 1x --limit 18");
    let ticks = lab.log("clock").run.result.ticks;
    assert_eq!(ticks, 360);
    assert_eq!(facts["clock_ms"], (ticks - 1) * 50, "{facts}");
    // No agent publishes for 0.5 s of wall-clock time, in which a run at 1x passes 0.5 s or less.
    assert!(facts["gap_ms"].as_u64() < Some(2000), "{facts}");
    // Otherwise only one agent does.
    let count = facts["topics"]["clock"].as_u64();
    assert!(count < Some(ticks * 3 / 2), "{facts}");
    lab.assert_repeated("clock");
}

#[test]
fn an_agent_without_a_router_ends_with_the_reason() {
    let lab = lab();
    let agent = "cluster agent --robot blue-1 --ros --ros-router tcp/127.0.0.1:9";
    let finished = lab.run(agent).expect(3);
    let expected = "alliance cluster agent: no zenoh router has answered at tcp/127.0.0.1:9; start `ros2 run rmw_zenoh_cpp rmw_zenohd`\n";
    assert_eq!(finished.stderr, expected);
    for (arguments, expected) in [
        (
            "cluster agent --ros=233",
            "invalid value '233' for '--ros[=<DOMAIN>]'",
        ),
        (
            "cluster agent --ros --ros-lockstep=0",
            "invalid value '0' for '--ros-lockstep[=<TIME>]'",
        ),
        ("cluster agent --ros-lockstep", "--ros"),
    ] {
        let refusal = lab.refusal(arguments);
        assert!(refusal.contains(expected), "{arguments}: {refusal}");
    }
}
