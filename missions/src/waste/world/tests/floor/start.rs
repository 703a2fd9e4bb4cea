//! Start poses of robots.

use crate::waste::data::default_scenario;
use std::f32::consts::PI;

use scenario::Room;

use super::*;
use proto::readings::Pose;

use world_server::world::StartError;

fn start_poses(scenario: &Scenario) -> Result<Vec<Pose>, StartError> {
    world_server::world::start_poses(scenario, (MISSION.world.start_area)(scenario), &[], &[])
}

fn team(count: usize, width_m: f32, height_m: f32) -> Scenario {
    let robot = |rank: usize| Robot {
        name: format!("r{rank}"),
        side_sensor: false,
        absent: false,
        start: None,
        ..Robot::default()
    };
    Scenario {
        robots: (0..count).map(robot).collect(),
        room: Room { width_m, height_m },
        ..default_scenario()
    }
}

#[track_caller]
fn assert_apart(scenario: &Scenario) -> Vec<Vec2> {
    let poses = start_poses(scenario).expect("there is room");
    assert!(poses.iter().all(|pose| pose.heading_rad == PI));
    let places = poses.iter().map(|pose| pose.position).collect::<Vec<_>>();
    let size = Vec2::new(scenario.room.width_m, scenario.room.height_m);
    for (index, place) in places.iter().enumerate() {
        assert!(
            place.min_element() > 0.2 && (size - *place).min_element() > 0.2,
            "{place}"
        );
        assert!(
            places[..index]
                .iter()
                .all(|other| other.distance(*place) > 0.4)
        );
    }
    places
}

#[test]
fn three_robots_stand_evenly_on_the_report_site() {
    let places = assert_apart(&team(3, 12.0, 9.0));
    assert_at(places[0], 0.3, 5.5);
    assert_at(places[1], 0.3, 4.5);
    assert_at(places[2], 0.3, 3.5);
}

#[test]
fn small_rooms_and_large_teams_have_room() {
    for count in 1..=8 {
        assert_apart(&team(count, 4.0, 3.0));
    }
    assert_apart(&team(10, 12.0, 9.0));
    assert_apart(&team(300, 60.0, 40.0));
    // More robots than fit along the height of the site.
    assert_apart(&team(300, 12.0, 9.0));
}

#[test]
fn they_keep_clear_of_obstacles_and_of_given_starts() {
    let mut scenario = team(3, 12.0, 9.0);
    scenario.robots[1].start = Some(Start {
        x_m: 0.3,
        y_m: 5.4,
        heading_deg: 180.0,
    });
    scenario.obstacles = vec![rectangle(0.0, 3.0, 1.0, 1.0, 0.0)];
    let places = assert_apart(&scenario);
    assert_at(places[1], 0.3, 5.4);
    for place in places {
        assert!(
            !(place.x < 1.2 && place.y < 4.2),
            "{place} is on the obstacle"
        );
    }
}

#[test]
fn a_scenario_without_room_is_refused() {
    assert_eq!(
        start_poses(&team(100, 4.0, 3.0))
            .map(|_| ())
            .map_err(|error| matches!(error, StartError::NoRoom(_))),
        Err(true)
    );
    let mut scenario = team(2, 12.0, 9.0);
    let start = |x_m| {
        Some(Start {
            x_m,
            y_m: 4.0,
            heading_deg: 0.0,
        })
    };
    scenario.robots[0].start = start(0.1);
    assert_eq!(start_poses(&scenario), Err(StartError::Taken(BLUE)));
    scenario.robots[0].start = start(5.0);
    scenario.robots[1].start = start(5.3);
    assert_eq!(start_poses(&scenario), Err(StartError::Taken(GOLD)));
    scenario.body.robot_penetrability = 1.0;
    assert!(start_poses(&scenario).is_ok());
}

#[test]
fn a_start_that_touches_a_wall_is_no_overlap() {
    let mut scenario = team(1, 12.0, 9.0);
    scenario.robots[0].start = Some(Start {
        x_m: 11.8,
        y_m: 8.8,
        heading_deg: 0.0,
    });
    assert!(start_poses(&scenario).is_ok());
}

#[test]
fn absent_robots_have_a_start_and_occupy_none() {
    let mut scenario = team(4, 12.0, 9.0);
    scenario.robots[1].absent = true;
    let poses = start_poses(&scenario).expect("there is room");
    let without = start_poses(&team(3, 12.0, 9.0)).expect("there is room");
    assert_eq!([poses[0], poses[2], poses[3]], *without);
    // The place where a single robot would start.
    assert_at(poses[1].position, 0.3, 4.5);
    // Robots may occupy a given start of an absent robot, obstacles may not.
    scenario.robots[1].start = Some(Start {
        x_m: 0.3,
        y_m: 5.5,
        heading_deg: 0.0,
    });
    assert_eq!(start_poses(&scenario).map(|poses| poses[0]), Ok(without[0]));
    scenario.obstacles = vec![rectangle(0.2, 5.4, 0.2, 0.2, 0.0)];
    assert_eq!(start_poses(&scenario), Err(StartError::Taken(GOLD)));
}

/// A start area may lie anywhere in the room. The robots stand around its middle.
#[test]
fn robots_stand_in_the_middle_of_a_start_area_away_from_the_walls() {
    let area = [Vec2::new(6.0, 1.0), Vec2::new(8.0, 2.6)];
    let places = |count| {
        let scenario = team(count, 12.0, 9.0);
        let poses = world_server::world::start_poses(&scenario, area, &[], &[]).unwrap();
        poses.iter().map(|pose| pose.position).collect::<Vec<_>>()
    };
    let two = places(2);
    assert_at(two[0], 7.0, 2.2);
    assert_at(two[1], 7.0, 1.4);
    // Six robots do not fit into one column.
    let six = places(6);
    assert_at(six[0], 7.0, 1.8);
    assert_at(six[1], 7.0, 1.3);
    assert_at(six[2], 7.0, 2.3);
}
