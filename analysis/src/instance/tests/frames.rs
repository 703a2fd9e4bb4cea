//! Places, scales and maps.

use super::*;
use crate::instance::map::{Cells, OccupancyMap};

/// Returns a table of two tasks at these places and a robot at the first one.
fn two(first: [f64; 2], second: [f64; 2]) -> String {
    let rows = [
        ("robot,r", first, ""),
        ("task,a", first, "5"),
        ("task,b", second, "5"),
    ];
    let rows = rows.map(|(head, [x, y], work)| format!("{head},{x},{y},{work}\n"));
    "type,id,x_m,y_m,work_s\n".to_owned() + &rows.concat()
}

fn frame_of(text: &str, options: &Options) -> (Vec<[f32; 2]>, [f32; 2], f32, String) {
    let converted = import("two.csv", text, options).unwrap();
    let scenario = &converted.scenario;
    (
        places(scenario),
        scenario.room.size().to_array(),
        scenario.body.speed_m_s,
        converted.written.notes[0].clone(),
    )
}

#[test]
fn places_stay_where_a_room_contains_them() {
    let default = Options::default();
    let of = |first, second| frame_of(&two(first, second), &default);
    let same = "frame: 1 unit of length is 1 m; places are not shifted";
    assert_eq!(
        of([4.0, 2.5], [8.0, 6.0]),
        (
            vec![[4.0, 2.5], [8.0, 6.0]],
            [9.0, 7.0],
            0.5,
            same.to_owned()
        )
    );
    let (at, room, speed, note) = of([-30.5, 2.0], [20.0, 6.0]);
    assert_eq!(
        (at, room, speed),
        (vec![[-30.5, 2.0], [20.0, 6.0]], [53.0, 7.0], 0.5)
    );
    assert_eq!(note, same);
    // Coordinates of a national grid, and a frame of 40 km.
    let (at, room, speed, note) = of([565_000.0, 5_930_000.0], [605_000.0, 5_931_000.0]);
    assert_eq!(at, [[1.0, 1.0], [40_001.0, 1001.0]]);
    assert_eq!((room, speed), ([40_002.0, 1002.0], 0.5));
    assert_eq!(
        note,
        "frame: 1 unit of length is 1 m; places are shifted by (-564999, -5929999) m"
    );
    let (at, room, speed, note) = of([-300_000.0, 0.0], [300_000.0, 7.0]);
    assert_eq!(at, [[-30_000.0, 0.0], [30_000.0, 0.7]]);
    assert_eq!((room, speed), ([60_002.0, 3.0], 0.05));
    assert_eq!(
        note,
        "frame: 1 unit of length is 0.1 m, and speeds are scaled alike; places are not shifted"
    );
}

/// The steps of a robot exceed the resolution of coordinates.
#[test]
fn large_rooms_have_long_steps() {
    let step_ms = |second| {
        let converted = import("two.csv", &two([0.0, 0.0], second), &Options::default()).unwrap();
        converted.scenario.step_ms
    };
    assert_eq!(step_ms([900.0, 900.0]), 50);
    assert_eq!(step_ms([40_000.0, 900.0]), 100);
    assert_eq!(step_ms([99_998.0, 900.0]), 200);
}

#[test]
fn a_unit_square_without_a_unit_is_enlarged() {
    let small = VRPLIB
        .replace("30 40", "0.30 0.40")
        .replace("37 52", "0.37 0.52")
        .replace("49 49", "0.49 0.49")
        .replace("52 64", "0.52 0.64");
    let converted = imported("tiny.vrp", &small);
    assert_eq!(
        places(&converted.scenario),
        [[37.0, 52.0], [49.0, 49.0], [52.0, 64.0]]
    );
    assert_eq!(converted.scenario.body.speed_m_s, 100.0);
}

#[test]
fn a_stated_scale_is_used() {
    let options = Options {
        scale: Some(0.5),
        ..Options::default()
    };
    let (at, _, speed, _) = frame_of(&two([4.0, 4.0], [8.0, 6.0]), &options);
    assert_eq!((at, speed), (vec![[2.0, 2.0], [4.0, 3.0]], 0.25));
    let far = two([0.0, 0.0], [300_000.0, 6.0]);
    let refused = import("two.csv", &far, &options).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "--scale: the places extend over 150000 m; use at most 0.333326"
    );
}

/// A room of 20 × 12 cells of 0.5 m with a wall that has a gap, as drawn; `#` is solid. Its corner is at (-3, -2).
fn hall() -> OccupancyMap {
    let mut solid = Cells::new(20, 12);
    for row in 0..12 {
        for column in 0..20 {
            let is_border = row == 0 || row == 11 || column == 0 || column == 19;
            solid.set(column, row, is_border || (column == 10 && row < 8));
        }
    }
    OccupancyMap {
        solid,
        unknown: 0,
        resolution_m: 0.5,
        origin: [-3.0, -2.0],
    }
}

#[test]
fn the_walls_of_a_map_are_obstacles_exact_to_a_cell() {
    let options = Options {
        map: Some(hall()),
        ..Options::default()
    };
    let converted = import("two.csv", &two([0.0, 0.0], [5.0, 1.0]), &options).unwrap();
    let scenario = &converted.scenario;
    assert_eq!(scenario.room.size().to_array(), [10.0, 6.0]);
    assert_eq!(scenario.room.low().to_array(), [-3.0, -2.0]);
    assert_eq!(places(scenario), [[0.0, 0.0], [5.0, 1.0]]);
    assert!(scenario.obstacles.len() <= 6, "{:?}", scenario.obstacles);
    let map = hall();
    for row in 0..12 {
        for column in 0..20 {
            let (x_m, y_m) = (0.5 * column as f32 - 2.75, 0.5 * row as f32 - 1.75);
            let is_solid = scenario
                .obstacles
                .iter()
                .any(|each| each.contains(x_m, y_m));
            assert_eq!(
                is_solid,
                map.solid.is_set(column, row),
                "cell {column}, {row}"
            );
        }
    }
    assert_eq!(
        converted.written.notes[1],
        "map: 67 solid cells of 0.5 m, 0 of them unknown, are 5 rectangles"
    );
}

#[test]
fn a_task_in_a_wall_or_outside_the_map_is_refused_with_its_line() {
    let options = Options {
        map: Some(hall()),
        ..Options::default()
    };
    let lines = [[2.25, 0.0], [-2.9, 0.0], [40.0, 0.0]].map(|second| {
        let refused = import("two.csv", &two([0.0, 0.0], second), &options).unwrap_err();
        format!("{refused}\n")
    });
    insta::assert_snapshot!(lines.concat());
}

#[test]
fn robots_at_one_depot_may_overlap_only_as_vehicles() {
    let converted = imported("small4.txt", SOLOMON);
    let starts: Vec<_> = converted
        .scenario
        .robots
        .iter()
        .filter_map(|robot| robot.start)
        .collect();
    assert_eq!(starts[0], starts[1]);
    let world = Registry::built_in();
    let world = world.worlds().find(&converted.scenario).unwrap();
    assert!(world.start_poses(&converted.scenario).is_ok());
}
