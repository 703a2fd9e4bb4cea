//! Whole waste missions in one process, in easy, hard, tiny and large rooms. `examples/rooms.rs` runs more rooms.

use alliance_tests::closed_loop::{Mission, run};
use alliance_tests::rooms::random_room;
use missions::waste::data::{WasteSection, default_scenario};
use proto::tick::Outcome;
use scenario::{Obstacle, Robot, Scenario, TaskSection};

fn mission(scenario: Scenario, seed: u64) -> Mission {
    run(scenario, seed, |_, _, _| ())
}

/// Checks that the mission delivers every item within `limit_s` of simulated time.
fn assert_complete(scenario: Scenario, seed: u64, limit_s: f64) {
    let name = scenario.name.clone();
    let mission = mission(
        Scenario {
            limit_s,
            ..scenario
        },
        seed,
    );
    assert_eq!(
        mission.outcome,
        Outcome::Complete,
        "{name}, seed {seed}: {mission:?}"
    );
    assert_eq!(
        mission.items.delivered,
        mission.items.total(),
        "{name}, seed {seed}"
    );
}

fn in_room(width_m: f32, height_m: f32) -> Scenario {
    let mut scenario = default_scenario();
    scenario.room.width_m = width_m;
    scenario.room.height_m = height_m;
    scenario
}

fn with_robots(count: usize) -> Scenario {
    let robot = |rank: usize| Robot {
        name: format!("robot{rank}"),
        side_sensor: rank == 0,
        ..Robot::default()
    };
    Scenario {
        robots: (0..count).map(robot).collect(),
        ..default_scenario()
    }
}

fn with_items(top: u32, bottom: u32) -> Scenario {
    let mut scenario = default_scenario();
    WasteSection::of_mut(&mut scenario).spills[0].items = top;
    WasteSection::of_mut(&mut scenario).spills[1].items = bottom;
    scenario
}

/// Runs a fixed part of the 200 rooms, with three times their median duration as limit.
#[test]
fn random_rooms_complete() {
    for seed in 1..=12 {
        assert_complete(random_room(seed), seed, 1230.0);
    }
}

/// Runs the slowest of the 200 rooms: half-covered spills and obstacles on the way to the deposit.
#[test]
fn hard_rooms_complete() {
    for seed in [14, 26, 123, 164, 194] {
        assert_complete(random_room(seed), seed, 1230.0);
    }
}

#[test]
fn long_and_short_steps_make_little_difference() {
    for step_ms in [10, 200, 500] {
        let scenario = Scenario {
            step_ms,
            ..default_scenario()
        };
        assert_complete(scenario, 1, 450.0);
        let scenario = Scenario {
            step_ms,
            ..random_room(2)
        };
        assert_complete(scenario, 2, 1230.0);
    }
}

#[test]
fn a_tiny_room_completes() {
    assert_complete(in_room(4.0, 3.0), 1, 400.0);
}

#[test]
fn a_large_room_completes() {
    assert_complete(in_room(60.0, 40.0), 1, 4000.0);
}

#[test]
fn wander_alone_finds_the_locations_of_a_large_room() {
    let mut scenario = in_room(60.0, 40.0);
    for robot in &mut scenario.robots {
        robot.side_sensor = false;
    }
    assert_complete(scenario, 1, 4000.0);
}

#[test]
fn one_robot_completes_alone() {
    assert_complete(with_robots(1), 1, 900.0);
    assert_complete(
        Scenario {
            robots: with_robots(1).robots,
            ..random_room(58)
        },
        58,
        2500.0,
    );
    // Without a side sensor, a robot can only wander.
    let mut wanderer = with_robots(1);
    wanderer.robots[0].side_sensor = false;
    assert_complete(wanderer, 1, 3600.0);
}

#[test]
fn eight_robots_complete() {
    assert_complete(with_robots(8), 1, 600.0);
}

/// Several robots on each spill often meet at the deposit.
#[test]
fn a_crowd_completes() {
    let mut scenario = Scenario {
        robots: with_robots(8).robots,
        ..random_room(3)
    };
    for task in ["move-spill(top)", "move-spill(bottom)"] {
        let section = TaskSection {
            max_robots: Some(4),
            ..TaskSection::default()
        };
        scenario.tasks.insert(task.to_owned(), section);
    }
    assert_complete(scenario, 3, 1200.0);
}

#[test]
fn a_spill_that_touches_an_obstacle_is_moved() {
    let mut scenario = default_scenario();
    scenario.obstacles.push(Obstacle {
        x_m: 4.5,
        y_m: 5.0,
        width_m: 1.0,
        height_m: 1.5,
        penetrability: 0.0,
    });
    assert_complete(scenario, 1, 700.0);
}

#[test]
fn all_items_in_one_spill_are_moved() {
    assert_complete(with_items(24, 0), 1, 1000.0);
}

#[test]
fn no_items_at_all_is_complete_at_once() {
    let mission = mission(with_items(0, 0), 1);
    assert_eq!(mission.outcome, Outcome::Complete);
    assert_eq!(mission.took.0, 0);
}

/// A regression test from the campaign. Two behavior sets with equal motivation are chosen in the order of
/// declaration. A lone robot therefore must not return to the covered spill forever.
#[test]
fn a_covered_spill_does_not_keep_a_lone_robot_from_the_other_spill() {
    let obstacle = |x_m, y_m, width_m, height_m| Obstacle {
        x_m,
        y_m,
        width_m,
        height_m,
        penetrability: 0.0,
    };
    let mut scenario = with_items(4, 4);
    scenario.robots.truncate(1);
    scenario.step_ms = 100;
    scenario.obstacles = vec![
        obstacle(9.493746, 5.681542, 1.1286564, 0.5318775),
        obstacle(6.2828526, 3.402944, 1.674047, 2.2164245),
        obstacle(8.299158, 8.482492, 1.1848698, 0.51750755),
        obstacle(1.339139, 1.0825837, 0.7022884, 0.39137936),
        obstacle(2.5943823, 5.4575057, 2.4318628, 1.7063537),
        obstacle(6.362297, 0.0, 2.1179008, 1.7424195),
    ];
    for seed in [201, 202, 203] {
        assert_complete(scenario.clone(), seed, 2000.0);
    }
}
