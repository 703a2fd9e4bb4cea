//! Hard rooms by real processes: some of the 200 random rooms of `--example rooms`, and extreme rooms.

use alliance_tests::rooms::random_room;
use missions::waste::data::{WasteSection, default_scenario};
use scenario::{Obstacle, Robot, Room, Scenario};

use crate::harness::Lab;

/// Three times the median duration of 200 random rooms, in s.
const RANDOM_LIMIT_S: &str = "1224";

/// Checks that the mission delivers every item.
#[track_caller]
fn assert_completes(name: &str, scenario: Scenario, limit_s: &str) {
    let items: u32 = WasteSection::of(&scenario)
        .spills
        .iter()
        .map(|spill| spill.items)
        .sum();
    let lab = Lab::new();
    let file = format!("{name}.toml");
    std::fs::write(lab.path(&file), scenario.to_toml().unwrap()).unwrap();
    let finished = lab.mission(
        "run",
        &[&file, "--limit", limit_s, "--log", "summary", "--json"],
    );
    let result = finished.expect(0).json();
    assert_eq!(result["outcome"], "complete", "{name}");
    assert_eq!(result["result"]["items"]["delivered"], items, "{name}");
    assert_eq!(result["unscripted"], false, "{name}");
}

fn with(change: impl FnOnce(&mut Scenario)) -> Scenario {
    let mut scenario = default_scenario();
    change(&mut scenario);
    scenario
}

fn robots(count: usize) -> Vec<Robot> {
    (0..count)
        .map(|rank| Robot {
            name: format!("r{rank}"),
            side_sensor: rank == 0,
            ..Robot::default()
        })
        .collect()
}

#[test]
fn random_rooms_with_obstacles_complete() {
    for seed in [1, 7, 42, 99, 163, 200] {
        assert_completes(&format!("room-{seed}"), random_room(seed), RANDOM_LIMIT_S);
    }
}

#[test]
fn a_room_of_4_by_3_meters_completes() {
    let room = Room {
        width_m: 4.0,
        height_m: 3.0,
    };
    assert_completes("small", with(|scenario| scenario.room = room), "3600");
}

#[test]
fn a_room_of_60_by_40_meters_completes() {
    let room = Room {
        width_m: 60.0,
        height_m: 40.0,
    };
    assert_completes("large", with(|scenario| scenario.room = room), "10000");
}

#[test]
fn one_robot_completes_with_and_without_a_side_sensor() {
    assert_completes(
        "alone",
        with(|scenario| scenario.robots = robots(1)),
        "3600",
    );
    let wanderer = with(|scenario| {
        scenario.robots = robots(1);
        scenario.robots[0].side_sensor = false;
    });
    assert_completes("wanderer", wanderer, "3600");
}

#[test]
fn eight_robots_complete() {
    assert_completes(
        "eight",
        with(|scenario| scenario.robots = robots(8)),
        "3600",
    );
}

#[test]
fn a_spill_that_touches_an_obstacle_completes() {
    let spill = with(|scenario| {
        scenario.obstacles = vec![Obstacle {
            x_m: 4.3,
            y_m: 5.5,
            width_m: 0.6,
            height_m: 1.0,
            penetrability: 0.0,
        }];
    });
    assert_completes("touching", spill, "3600");
}

#[test]
fn missions_without_items_and_with_all_items_in_one_spill_complete() {
    let none = with(|scenario| {
        for spill in &mut WasteSection::of_mut(scenario).spills {
            spill.items = 0;
        }
    });
    assert_completes("none", none, "3600");
    let one = with(|scenario| {
        WasteSection::of_mut(scenario).spills[0].items = 24;
        WasteSection::of_mut(scenario).spills[1].items = 0;
    });
    assert_completes("one", one, "3600");
}
