//! Robots whose bodies differ.

use std::collections::BTreeMap;

use alliance_proto::log::{LogLevel, PoseRow, RunLog};
use alliance_proto::scenario::{Scenario, Setup};

use crate::in_process::run;

/// The first minute of the default mission after some changes: poses.csv.
fn poses(change: impl FnOnce(&mut Scenario)) -> Vec<PoseRow> {
    let mut scenario = Scenario {
        limit_s: 60.0,
        ..Scenario::default()
    };
    change(&mut scenario);
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let (_, recorder) = run(setup, LogLevel::Full);
    let log = RunLog::from_memory(&recorder.into_sink()).unwrap();
    log.rows().unwrap()
}

/// The highest speed of each robot, m/s.
fn top_speeds(poses: Vec<PoseRow>) -> BTreeMap<String, f32> {
    let mut fastest: BTreeMap<String, f32> = BTreeMap::new();
    for row in poses {
        let fastest = fastest.entry(row.robot).or_default();
        *fastest = fastest.max(row.speed_m_s);
    }
    fastest
}

#[test]
fn a_robot_that_is_stated_slower_is_slower() {
    let fastest = top_speeds(poses(|scenario| {
        scenario.robots[1].speed_m_s = Some(0.2);
    }));
    let near = |robot: &str, speed_m_s: f32| (fastest[robot] - speed_m_s).abs() < 1e-3;
    assert!(
        near("blue", 0.5) && near("gold", 0.2) && near("green", 0.5),
        "{fastest:?}"
    );
}

/// What a robot states as the team has it changes nothing.
#[test]
fn a_body_like_the_teams_is_the_teams() {
    let stated = poses(|scenario| {
        for robot in &mut scenario.robots {
            robot.speed_m_s = Some(scenario.body.speed_m_s);
            robot.turn_deg_s = Some(scenario.body.turn_deg_s);
        }
    });
    assert!(stated == poses(|_| {}));
}

#[test]
fn the_side_sensor_is_a_device_like_others() {
    let stated = poses(|scenario| {
        scenario.robots[0].side_sensor = false;
        scenario.robots[0].devices = vec!["side-border".to_owned()];
    });
    assert!(stated == poses(|_| {}));
}
