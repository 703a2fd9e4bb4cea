//! A bag of ROS 2 contains the values of the log, for readers that others wrote.

use std::process::Command;

use alliance_tests::harness::Lab;
use alliance_tests::needs::cannot_run;
use alliance_tests::python::python;
use alliance_tests::testkit::in_repository;
use serde_json::{Value, json};

use super::{BAD_DAY, read};

const READERS: [&str; 4] = ["jsonschema", "mcap", "mcap_ros2", "rosbags"];

/// The types of all messages, as ROS names them.
const TYPES: [&str; 9] = [
    "diagnostic_msgs/msg/DiagnosticArray",
    "nav_msgs/msg/OccupancyGrid",
    "nav_msgs/msg/Odometry",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/msg/String",
    "tf2_msgs/msg/TFMessage",
    "visualization_msgs/msg/MarkerArray",
];

/// Writes the bad day with a robot whose name ROS does not accept, and with faults of a position sensor.
fn write_day(lab: &Lab) {
    let timeline = r#"
    { fault.sensor = { robot = "blue", device = "position", mode.bias = { m = 0.5 } }, at_s = 20.0, for_s = 5.0 },
    { fault.sensor = { robot = "blue", device = "position", mode = "dead" }, at_s = 30.0, for_s = 10.0 },
]
"#;
    let day = BAD_DAY.replace("\"red\"", "\"red-2\"");
    let day = day.trim_end().strip_suffix(']').unwrap();
    lab.write("day.toml", format!("{day}{timeline}"));
}

#[test]
fn a_bag_contains_the_log_for_the_readers_of_others() {
    let lab = Lab::new();
    write_day(&lab);
    lab.mission("run", "day.toml --limit 60 --in-process --log full")
        .expect(1);
    let finished = lab.run("export run --rosbag").expect(0);
    assert_eq!(finished.answer(), "rosbag  run/rosbag\n");
    let files = ["metadata.yaml", "rosbag_0.mcap"];
    assert_eq!(lab.names("run/rosbag"), files);
    // The bag does not depend on the log level.
    lab.mission("off", "day.toml --limit 60 --in-process --log off")
        .expect(1);
    lab.run("export off --rosbag").expect(0);
    for file in files {
        let [first, second] = ["run", "off"].map(|run| lab.bytes(&format!("{run}/rosbag/{file}")));
        assert!(first == second, "{file}");
    }

    let Some(python) = python(&READERS) else {
        return;
    };
    // The script compares every message with the log, and its bytes with those of another encoder.
    let found = read(&lab, &python, "read_rosbag.py", &["run", "run/rosbag"]);
    let rows = |table: &str| lab.text(&format!("run/{table}.csv")).lines().count() - 1;
    assert_eq!(found["start_ns"], 1);
    assert_eq!(found["end_ms"], 60_000);
    assert_eq!(found["types"], json!(TYPES));
    assert_eq!(found["topics"]["/clock"], 1201);
    assert_eq!(found["topics"]["/tf"], 1201);
    assert_eq!(found["poses"], rows("poses"));
    assert_eq!(found["events"], rows("events"));
    assert_eq!(found["run"]["hash"], json!(lab.log("run").run.hash));
    assert!(found["run"]["scenario_toml"].as_str() > Some(""));
    assert!(found["allocations"].as_u64() > Some(5));

    // A dead sensor publishes nothing, and a biased one something else than the truth.
    let span = |from_ms: u64, to_ms: u64| -> Value { (from_ms..to_ms).step_by(50).collect() };
    let odometry = &found["odometry"]["blue"];
    assert_eq!(odometry["false"], span(20_000, 25_000));
    assert_eq!(odometry["missing"], span(30_000, 40_000));
    assert_eq!(odometry["readings"], 1000);
    // gold has no agent for five seconds.
    let missing = found["odometry"]["gold"]["missing"].as_array().unwrap();
    assert!((90..=110).contains(&missing.len()), "{missing:?}");
    for count in ["scans", "hits", "points", "border"] {
        assert!(found["scans"][count].as_u64() > Some(100), "{count}");
    }

    // Slow ground from the start, and an obstacle for ten seconds.
    assert_eq!(
        found["obstacles"],
        json!([[0, 1], [30_050, 2], [40_050, 1]])
    );
    // The border, the slow ground of 20 × 30 cells, and the obstacle of 10 × 20 cells.
    let border = 2 * (242 + 180);
    let free = 240 * 180 - 600;
    assert_eq!(
        found["maps"],
        json!([
            [0, { "0": free, "50": 600, "100": border }],
            [30_050, { "0": free - 200, "50": 600, "100": border + 200 }],
            [40_050, { "0": free, "50": 600, "100": border }],
        ])
    );
    let texts = |frame: &str| found["texts"][frame].as_array().unwrap();
    assert!(texts("gold/base_link").contains(&json!("gold: dead")));
    assert!(texts("red_2/base_link").contains(&json!("red-2: idle")));
    let levels = |robot: &str| found["levels"][robot].as_array().unwrap();
    assert_eq!(levels("blue"), &[0]);
    assert!(levels("gold").contains(&json!(2)));
    assert_eq!(levels("red-2")[0], 3);
    let armed = found["faults"].as_array().unwrap();
    assert!(armed.len() > 5, "{armed:?}");

    let layout = in_repository("docs/layouts/ros.rviz");
    let files = [layout.to_str().unwrap(), "run/rosbag"];
    let shown = read(&lab, &python, "read_rviz.py", &files);
    let shown = shown.as_array().unwrap();
    for topic in ["/map", "/markers", "/blue/odom", "/green/scan"] {
        assert!(shown.contains(&json!(topic)), "{topic}: {shown:?}");
    }
}

#[test]
fn other_encoders_write_the_bytes_of_the_bag() {
    let lab = Lab::new();
    write_day(&lab);
    lab.mission("run", "day.toml --limit 30 --in-process")
        .expect(1);
    lab.run("export run --rosbag").expect(0);
    // Each script encodes every decoded message again, and compares the bytes.
    if let Some(python) = python(&["cyclonedds", "rosbags"]) {
        let found = read(&lab, &python, "reencode_rosbag.py", &["run/rosbag"]);
        check_counts(&found);
    }
    if let Some(found) = read_with_node(&lab) {
        check_counts(&found);
    }
}

/// Checks the number of messages by type.
#[track_caller]
fn check_counts(found: &Value) {
    let mut types: Vec<&String> = found.as_object().unwrap().keys().collect();
    types.sort();
    assert_eq!(types, TYPES);
    assert_eq!(found["rosgraph_msgs/msg/Clock"], 601);
    // The frames of the bodies in each tick, and those of the sensors once.
    assert_eq!(found["tf2_msgs/msg/TFMessage"], 602);
    assert!(
        found["sensor_msgs/msg/PointCloud2"].as_u64() > Some(1000),
        "{found}"
    );
}

/// Returns what the JavaScript packages of Foxglove find in the bag, or `None` without them, if the test may be skipped.
fn read_with_node(lab: &Lab) -> Option<Value> {
    let modules = in_repository(".ci/node_modules");
    if !modules.join("@mcap/core").is_dir() {
        cannot_run("no @mcap/core: run `npm ci --prefix .ci`");
        return None;
    }
    let output = Command::new("node")
        .arg(in_repository("tests/node/read_rosbag.mjs"))
        .args([modules, lab.path("run/rosbag/rosbag_0.mcap")])
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    Some(serde_json::from_slice(&output.stdout).unwrap())
}
