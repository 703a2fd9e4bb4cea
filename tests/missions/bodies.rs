//! Robots whose bodies differ.

use missions::Registry;
use missions::waste::data::default_scenario;
use std::collections::BTreeMap;

use run_log::{LogLevel, PoseRow, RunLog};
use scenario::{Scenario, Setup};

use crate::in_process::run;

/// Returns poses.csv of the first minute of the default mission after `change`.
fn poses(change: impl FnOnce(&mut Scenario)) -> Vec<PoseRow> {
    let mut scenario = Scenario {
        limit_s: 60.0,
        ..default_scenario()
    };
    change(&mut scenario);
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let (_, recorder) = run(setup, LogLevel::Full);
    let log =
        RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
    log.rows().unwrap()
}

/// Returns the highest speed of each robot, in m/s.
fn top_speeds(poses: Vec<PoseRow>) -> BTreeMap<String, f32> {
    let mut fastest: BTreeMap<String, f32> = BTreeMap::new();
    for row in poses {
        let fastest = fastest.entry(row.robot).or_default();
        *fastest = fastest.max(row.speed_m_s);
    }
    fastest
}

#[test]
fn a_robot_with_a_lower_speed_limit_is_slower() {
    let blue = |speed_m_s| {
        let poses = poses(|scenario| scenario.robots[0].speed_m_s = speed_m_s);
        top_speeds(poses)["blue"]
    };
    assert!((blue(None) - 0.5).abs() < 1e-3);
    assert!((blue(Some(0.2)) - 0.2).abs() < 1e-3);
}

#[test]
fn a_body_with_the_teams_values_changes_nothing() {
    let stated = poses(|scenario| {
        for robot in &mut scenario.robots {
            robot.speed_m_s = Some(scenario.body.speed_m_s);
            robot.turn_deg_s = Some(scenario.body.turn_deg_s);
        }
    });
    assert!(stated == poses(|_| {}));
}

#[test]
fn the_side_sensor_equals_its_device() {
    let stated = poses(|scenario| {
        scenario.robots[0].side_sensor = false;
        scenario.robots[0].devices = Some(vec!["side-border".to_owned()]);
    });
    assert!(stated == poses(|_| {}));
}
