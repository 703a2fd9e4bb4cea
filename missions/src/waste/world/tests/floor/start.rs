//! Start poses of robots.

use std::f32::consts::PI;

use proto::readings::Pose;
use scenario::Room;
use world_server::world::StartError;

use super::*;
use crate::waste::data::default_scenario;

fn start_poses(scenario: &Scenario) -> Result<Vec<Pose>, StartError> {
    world_server::world::start_poses(scenario, (MISSION.world.start_area)(scenario), &[], &[])
}

fn team(count: usize, width_m: f32, height_m: f32) -> Scenario {
    let robot = |rank: usize| Robot {
        name: format!("r{rank}"),
        ..Robot::default()
    };
    Scenario {
        robots: (0..count).map(robot).collect(),
        room: Room::of_size(width_m, height_m),
        ..default_scenario()
    }
}

fn positions(poses: &[Pose]) -> Vec<Vec2> {
    poses.iter().map(|pose| pose.position).collect()
}

#[track_caller]
fn assert_apart(scenario: &Scenario) -> Vec<Vec2> {
    let poses = start_poses(scenario).expect("there is room");
    assert!(poses.iter().all(|pose| pose.heading_rad == PI));
    let places = positions(&poses);
    let size = scenario.room.size();
    for (index, place) in places.iter().enumerate() {
        let to_wall = place.min(size - *place).min_element();
        assert!(to_wall > 0.2, "{place}");
        let mut others = places[..index].iter();
        assert!(others.all(|other| other.distance(*place) > 0.4));
    }
    places
}

#[test]
fn robots_stand_evenly_on_the_report_site_and_have_room_in_small_rooms_and_large_teams() {
    let places = assert_apart(&team(3, 12.0, 9.0));
    for (place, y) in places.into_iter().zip([5.5, 4.5, 3.5]) {
        assert_at(place, 0.3, y);
    }
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
    scenario.robots[1].start = Some(start_at((0.3, 5.4, 180.0)));
    scenario.obstacles = vec![solid(0.0, 3.0, 1.0, 1.0)];
    let places = assert_apart(&scenario);
    assert_at(places[1], 0.3, 5.4);
    let is_clear = |place: &Vec2| place.x >= 1.2 || place.y >= 4.2;
    assert!(places.iter().all(is_clear), "{places:?}");
}

#[test]
fn a_scenario_without_room_is_refused() {
    let crowd = start_poses(&team(100, 4.0, 3.0));
    assert!(matches!(crowd, Err(StartError::NoRoom(_))));
    let mut scenario = team(2, 12.0, 9.0);
    scenario.robots[0].start = Some(start_at((0.1, 4.0, 0.0)));
    assert_eq!(start_poses(&scenario), Err(StartError::Taken(BLUE)));
    // A start that touches a wall is no overlap.
    scenario.robots[0].start = Some(start_at((11.8, 8.8, 0.0)));
    assert!(start_poses(&scenario).is_ok());
    scenario.robots[1].start = Some(start_at((11.5, 8.8, 0.0)));
    assert_eq!(start_poses(&scenario), Err(StartError::Taken(GOLD)));
    scenario.body.robot_penetrability = 1.0;
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
    scenario.robots[1].start = Some(start_at((0.3, 5.5, 0.0)));
    assert_eq!(start_poses(&scenario).map(|poses| poses[0]), Ok(without[0]));
    scenario.obstacles = vec![solid(0.2, 5.4, 0.2, 0.2)];
    assert_eq!(start_poses(&scenario), Err(StartError::Taken(GOLD)));
}

/// A start area may lie anywhere in the room. The robots stand around its middle.
#[test]
fn robots_stand_in_the_middle_of_a_start_area_away_from_the_walls() {
    let area = [Vec2::new(6.0, 1.0), Vec2::new(8.0, 2.6)];
    // Six robots do not fit into one column.
    for (count, column) in [(2, &[2.2, 1.4][..]), (6, &[1.8, 1.3, 2.3])] {
        let scenario = team(count, 12.0, 9.0);
        let poses = world_server::world::start_poses(&scenario, area, &[], &[]).unwrap();
        for (place, y) in positions(&poses).into_iter().zip(column) {
            assert_at(place, 7.0, *y);
        }
    }
}
