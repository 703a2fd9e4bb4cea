//! A team whose bodies move in another world, IR-SIM, completes its mission, and its decisions replay without that world.

use std::path::PathBuf;

use alliance_tests::harness::Lab;
use alliance_tests::observers::facts;
use alliance_tests::python::python;
use run_log::{EventRow, Input, PoseRow};
use serde_json::{Value, json};

/// Six points of work on the right, the bodies on the left.
const ELSEWHERE: &str = r#"
name = "elsewhere"
limit_s = 120
room = { width_m = 8.0, height_m = 6.0 }
robots = [{ name = "blue" }, { name = "gold" }, { name = "green" }]
[service]
kinds = [{ name = "fetch", work_s = { min = 2.0, max = 2.0 } }]
points = [
    { kind = "fetch", x_m = 5.0, y_m = 1.0 },
    { kind = "fetch", x_m = 5.0, y_m = 3.0 },
    { kind = "fetch", x_m = 5.0, y_m = 5.0 },
    { kind = "fetch", x_m = 7.0, y_m = 2.0 },
    { kind = "fetch", x_m = 7.0, y_m = 4.0 },
]
"#;

fn judge() -> Option<PathBuf> {
    python(&["zenoh", "rosbags", "xxhash", "irsim"])
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("elsewhere.toml", ELSEWHERE);
    lab
}

/// Runs the scenario with bodies in another world, which behaves according to `mode`.
#[track_caller]
fn run(lab: &Lab, python: &std::path::Path, mode: &str, arguments: &str) -> Value {
    let arguments = format!("elsewhere.toml --allocator cbba {arguments}");
    facts(
        lab,
        python,
        "external_world.py",
        &[mode, "7"],
        (mode, &arguments),
    )
}

fn stderr(facts: &Value) -> &str {
    facts["stderr"].as_str().unwrap()
}

#[test]
fn a_team_with_bodies_of_another_world_survives_a_crash_and_replays() {
    let Some(python) = judge() else { return };
    let lab = lab();
    // The script compares all poses of the log with those of the other world.
    let facts = run(&lab, &python, "mission", "");
    assert_eq!(facts["status"], 0, "{}", stderr(&facts));
    assert_eq!(facts["gold_moved_after_kill"], false);
    assert_eq!(facts["stands_at_end"], true);
    for robot in ["blue", "green"] {
        assert!(facts["moved"][robot].as_f64() > Some(2.0), "{facts}");
    }

    let log = lab.log("mission");
    assert!(log.run.unscripted);
    let events: Vec<EventRow> = log.rows().unwrap();
    let position = |kind: &str, robot: &str| {
        let found = |event: &EventRow| event.kind == kind && event.robot == robot;
        events.iter().position(found).unwrap()
    };
    let gone = position("gone", "gold");
    let done = |robot: &str| {
        let done = events.iter().enumerate();
        done.filter(|(_, event)| event.kind == "done" && event.robot == robot)
            .map(|(index, event)| (index, event.subject.clone()))
            .collect::<Vec<_>>()
    };
    // Gold is killed on its way, and the others do all points.
    assert!(gone > position("activated", "gold"));
    assert_eq!(done("gold"), []);
    let points: Vec<_> = ["blue", "green"].into_iter().flat_map(done).collect();
    assert_eq!(points.len(), 5, "{points:?}");

    // Each body has one pose per tick, which the table of poses shows.
    let inputs = log.inputs().unwrap();
    let bodies = inputs.iter().filter_map(|line| match &line.input {
        Input::Body(body) => Some((line.tick, body)),
        _ => None,
    });
    let poses: Vec<PoseRow> = log.rows().unwrap();
    let mut count = 0;
    for ((tick, body), row) in bodies.zip(&poses) {
        let found = (row.t_ms.0, &*row.robot, row.x_m, row.y_m);
        assert_eq!(found, (tick * 50, &*body.robot, body.x_m, body.y_m));
        count += 1;
    }
    assert_eq!(count, 3 * log.run.result.ticks);
    assert_eq!(
        facts["poses"],
        json!({ "blue": count / 3, "gold": count / 3, "green": count / 3 })
    );
    lab.assert_repeated("mission");
}

#[test]
fn scans_of_the_other_world_lead_bodies_around_its_obstacles() {
    let Some(python) = judge() else { return };
    let lab = lab();
    // The posts are in the way, and only the other world has them. The script compares all beams in the log with the scans.
    let seen = run(&lab, &python, "scan", "");
    assert_eq!(seen["status"], 0, "{}", stderr(&seen));
    // A body moves until its next command.
    assert!(seen["least_m"].as_f64() > Some(-0.1), "{seen}");
    let ticks = lab.log("scan").run.result.ticks;
    // The first tick needs no scan, and scans of a busy machine are late.
    assert!(seen["scans"].as_u64() > Some(3 * ticks / 2), "{seen}");
    assert!(seen["hits"].as_u64() > Some(0), "{seen}");
    lab.assert_repeated("scan");

    let blind = run(&lab, &python, "blind", "");
    // The way leads through the middle of a post.
    assert!(blind["least_m"].as_f64() < Some(-0.3), "{blind}");
    assert_eq!(blind["scans"], 0);
}

#[test]
fn a_body_whose_lidar_stops_stands_and_the_others_move() {
    let Some(python) = judge() else { return };
    let lab = lab();
    let facts = run(&lab, &python, "dark", "--limit 12 --stall-after 2");
    assert_eq!(
        facts["moved_when_lost"],
        json!(["blue", "green"]),
        "{}",
        stderr(&facts)
    );
    lab.assert_repeated("dark");
}

#[test]
fn bodies_stand_while_the_clock_is_paused() {
    let Some(python) = judge() else { return };
    let lab = lab();
    let facts = run(&lab, &python, "pause", "--limit 8");
    assert_eq!(facts["stands"], true);
    assert_eq!(facts["commands_while_paused"], 0);
    assert_eq!(
        facts["speed"],
        "alliance clock: speed: the bodies move in another world, which cannot change its speed; pause the clock instead"
    );
    assert_eq!(
        facts["move_robot"],
        "alliance fault: fault.move-robot: the body of the robot moves in another world"
    );
    assert_eq!(facts["stands_at_end"], true);
    lab.assert_repeated("pause");
}

#[test]
fn a_run_ends_when_its_bodies_are_lost() {
    let Some(python) = judge() else { return };
    let lab = lab();
    for (mode, expected) in [
        (
            "silent",
            "the other world has stopped sending: /blue/odom, /gold/odom, /green/odom",
        ),
        (
            "crash",
            "the bridge to the other world was killed by SIGKILL; the run ends",
        ),
    ] {
        let facts = run(&lab, &python, mode, "--stall-after 2");
        let lines = stderr(&facts).lines();
        let reasons: Vec<&str> = lines.filter(|line| line.contains("the run ends")).collect();
        let [reason] = reasons[..] else {
            panic!("{}", stderr(&facts));
        };
        assert!(reason.contains(expected), "{reason}");
        assert!(!stderr(&facts).contains("connected"), "{}", stderr(&facts));
        assert_eq!(facts["status"], 130);
        assert_eq!(facts["stands_at_end"], true, "{mode}");
        lab.assert_repeated(mode);
    }
}

#[test]
fn a_body_that_falls_silent_stands_and_the_others_move() {
    let Some(python) = judge() else { return };
    let lab = lab();
    let facts = run(&lab, &python, "one", "--limit 12 --stall-after 2");
    assert_eq!(
        facts["moved_when_lost"],
        json!(["blue", "green"]),
        "{}",
        stderr(&facts)
    );
    lab.assert_repeated("one");
}

#[test]
fn bodies_stand_after_the_world_is_killed() {
    let Some(python) = judge() else { return };
    let lab = lab();
    let facts = run(&lab, &python, "world", "");
    assert_eq!(facts["status"], 3, "{}", stderr(&facts));
    assert_eq!(facts["stands_at_end"], true);
}

#[test]
fn a_run_without_usable_poses_does_not_start() {
    let Some(python) = judge() else { return };
    let lab = lab();
    for (mode, expected) in [
        ("absent", "/gold/odom; "),
        ("nan", "/gold/odom (the pose is not finite); "),
        ("outside", "/gold/odom ((-3, 3) is not in the room); "),
        (
            "frame",
            "/gold/odom (the frame is 'odom', and must be 'map', that of the room); ",
        ),
    ] {
        let facts = run(&lab, &python, mode, "--stall-after 3");
        let line = format!(
            "alliance run: --external: no pose has arrived within 3 s on {expected}publish nav_msgs/Odometry in the frame \
             'map', or wait longer with --stall-after\n"
        );
        assert_eq!((stderr(&facts), &facts["status"]), (&*line, &json!(2)));
        assert!(!lab.exists(&format!("{mode}/run.json")));
    }
}

#[test]
fn runs_that_cannot_have_external_bodies_are_refused() {
    let lab = lab();
    lab.write(
        "names.toml",
        r#"robots = [{ name = "r-2" }, { name = "r_2" }]"#,
    );
    for (arguments, expected) in [
        (
            "run --external gazebo",
            "alliance: invalid value 'gazebo' for '--external <ros[:DOMAIN]>': use 'ros', or 'ros:DOMAIN' such as 'ros:7'; try --help\n",
        ),
        (
            "run --external ros:233",
            "alliance: invalid value 'ros:233' for '--external <ros[:DOMAIN]>': the domain must be 0 to 232; try --help\n",
        ),
        (
            "run --external ros --ros",
            "alliance: the argument '--external <ros[:DOMAIN]>' cannot be used with '--ros[=<DOMAIN>]'",
        ),
        (
            "run --external ros --speed 2x",
            "alliance: the argument '--external <ros[:DOMAIN]>' cannot be used with '--speed <max|FACTORx>'",
        ),
        (
            "run --external ros --in-process",
            "alliance: the argument '--external <ros[:DOMAIN]>' cannot be used with '--in-process'",
        ),
        (
            "run names.toml --external ros",
            "alliance run: --external: robots 'r-2' and 'r_2' have the same ROS name 'r_2'; rename the robot",
        ),
        (
            "run parker-box --external ros",
            "alliance run: --external: bodies of another world cannot push, and mission 'push' needs it; use another mission",
        ),
        (
            "run --no-page --out none --external ros --ros-router tcp/127.0.0.1:9 --stall-after 0.5",
            "alliance run: --external: no zenoh router has answered at tcp/127.0.0.1:9; start `ros2 run rmw_zenoh_cpp rmw_zenohd`\n",
        ),
    ] {
        let refusal = lab.refusal(arguments);
        assert!(refusal.starts_with(expected), "{arguments}: {refusal}");
    }
    assert!(!lab.exists("none/run.json"));
}
