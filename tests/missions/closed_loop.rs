//! Whole waste missions in one process, in easy, hard, tiny and large rooms. The campaigns of `alliance sweep` run
//! random rooms.

use alliance_tests::runs::{run, setup};
use analysis::random_mission::room::obstacles;
use missions::waste::data::{WasteSection, default_scenario};
use proto::tick::Outcome;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::LogLevel;
use scenario::{Obstacle, Robot, Scenario, TaskSection};

/// Checks that the mission delivers every item within `limit_s` of simulated time.
#[track_caller]
fn assert_complete(mut scenario: Scenario, seed: u64, limit_s: f64) {
    scenario.limit_s = limit_s;
    let name = scenario.name.clone();
    let (outcome, _) = run(setup(scenario, seed), LogLevel::Off);
    assert_eq!(outcome, Outcome::Complete, "{name}, seed {seed}");
}

/// Returns the default mission with 1 to 8 obstacles at random positions.
fn random_room(seed: u64) -> Scenario {
    let mut scenario = default_scenario();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = rng.random_range(1..=8);
    scenario.obstacles = obstacles(&scenario, count, &mut rng);
    scenario
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

/// Runs the slowest of 200 random rooms: half-covered spills and obstacles on the way to the deposit.
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
    }
}

#[test]
fn rooms_of_any_size_complete() {
    assert_complete(in_room(4.0, 3.0), 1, 400.0);
    assert_complete(in_room(60.0, 40.0), 1, 4000.0);
    // Without a side sensor, robots can only wander.
    let mut scenario = in_room(30.0, 20.0);
    for robot in &mut scenario.robots {
        robot.side_sensor = false;
    }
    assert_complete(scenario, 1, 4000.0);
}

#[test]
fn teams_of_any_size_complete() {
    assert_complete(with_robots(1), 1, 900.0);
    assert_complete(with_robots(8), 1, 600.0);
    // Several robots on each spill often meet at the deposit.
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
fn spills_of_any_size_and_next_to_an_obstacle_are_moved() {
    assert_complete(with_items(24, 0), 1, 1000.0);
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
    for seed in [201, 202] {
        assert_complete(scenario.clone(), seed, 2000.0);
    }
}
