//! Valid and invalid scenarios of observe, and their catalogs.

use glam::Vec2;
use proptest::prelude::*;
use scenario::Catalog;
use scenario::testkit::refusals;

use super::*;
use crate::fixtures::{parse, read, resolve};

#[test]
fn mistakes_give_messages_of_one_line() {
    let texts = [
        "n = 0",
        "n = 1000001",
        "policy = 'parker'",
        "range = 3",
        "slowest_m_s = 0.3",
        "range_m = 3.5",
        "target_near_m = 0.8",
        "robot_far_m = 1.0",
        "shared_weight = 2",
        "duration_s = 0",
    ]
    .map(|line| format!("[observe]\n{line}\n"));
    insta::assert_snapshot!(refusals("s.toml", texts, read));
}

/// Robots without motion or with random motion have one task, all others both.
#[test]
fn each_policy_has_its_tasks() {
    for (policy, tasks) in [
        ("fixed", vec!["observe"]),
        ("random", vec!["search"]),
        ("local", vec!["observe", "search"]),
        ("a-cmommt", vec!["observe", "search"]),
    ] {
        let scenario = parse(&format!("[observe]\npolicy = '{policy}'"));
        let catalog = Catalog::new(&scenario);
        let names = catalog.tasks.iter().map(|task| task.name.as_str());
        assert_eq!(names.collect::<Vec<_>>(), tasks);
        assert!(catalog.tasks.iter().all(|task| task.max_robots == 3));
    }
}

#[test]
fn the_family_is_valid_in_every_size_with_the_same_area_per_robot() {
    for (robots, targets) in [(1, 1), (1, 10_000), (5, 5), (100, 100), (10_000, 10_000)] {
        let scenario = OBSERVE.family(robots, targets).unwrap();
        assert_eq!(parse(&scenario.to_toml().unwrap()), scenario);
        let world = crate::observe::MISSION.world;
        world.start_poses(&scenario).unwrap();
        let Area::Disc { radius_m, .. } = Area::from_scenario(&scenario) else {
            panic!("a disc")
        };
        let per_robot = radius_m * radius_m / robots as f32;
        assert!((per_robot - 20.0).abs() < 0.1, "{per_robot}");
        // All keys but one have the defaults of an empty section.
        let default = parse("[observe]\n");
        let default = ObserveSection {
            n: targets as u32,
            ..ObserveSection::from_scenario(&default).clone()
        };
        assert_eq!(*ObserveSection::from_scenario(&scenario), default);
        resolve(scenario);
    }
}

fn areas() -> [Area; 2] {
    [
        Area::Disc {
            center: Vec2::new(5.0, 4.0),
            radius_m: 3.0,
        },
        Area::Rectangle {
            min: Vec2::new(1.0, 2.0),
            max: Vec2::new(9.0, 5.0),
        },
    ]
}

proptest! {
    #[test]
    fn areas_agree_with_themselves(x in -20.0..20.0_f32, y in -20.0..20.0_f32, u in 0.0..1.0_f32, v in 0.0..1.0_f32) {
        for area in areas() {
            let place = Vec2::new(x, y);
            let slightly_larger = area.inset(-1e-4);
            prop_assert!(slightly_larger.contains(area.nearest(place)));
            prop_assert!(slightly_larger.contains(area.place(Vec2::new(u, v))));
            prop_assert!(!area.contains(place) || area.nearest(place).distance(place) < 1e-5);
            match area.inward(place) {
                None => prop_assert!(area.contains(place)),
                Some(inward) => {
                    prop_assert!((inward.length() - 1.0).abs() < 1e-5);
                    let nearest = area.nearest(place);
                    prop_assert!(inward.dot(nearest - place) >= nearest.distance(place) - 1e-3);
                }
            }
            prop_assert!(!area.inset(0.5).contains(place) || area.contains(place));
        }
    }

    /// The distance between two spread places is not much smaller than in a square grid.
    #[test]
    fn spread_places_keep_their_distance(count in 2..60_usize) {
        for (area, size) in areas().into_iter().zip([9.0 * std::f32::consts::PI, 24.0]) {
            let places: Vec<Vec2> = area.spread(count).collect();
            prop_assert_eq!(places.len(), count);
            let grid_m = (size / count as f32).sqrt();
            for (index, place) in places.iter().enumerate() {
                prop_assert!(area.inset(-1e-4).contains(*place));
                for other in &places[..index] {
                    prop_assert!(place.distance(*other) > 0.3 * grid_m, "{} {}", place, other);
                }
            }
        }
    }
}

/// Without starts in the scenario. An obstacle takes one of the places, and its robot gets another.
#[test]
fn robots_start_spread_over_the_region() {
    let robots: String = (1..=5)
        .map(|robot| format!("[[robots]]\nname = 'r{robot}'\n"))
        .collect();
    let starts = |more: &str| -> Vec<Vec2> {
        let scenario = parse(&format!("[observe]\n{more}\n{robots}"));
        let poses = crate::observe::MISSION.world.start_poses(&scenario);
        poses.unwrap().iter().map(|pose| pose.position).collect()
    };
    let area = Area::from_scenario(&parse("[observe]\n")).inset(0.22);
    let spread: Vec<Vec2> = area.spread(5).collect();
    assert_eq!(starts(""), spread);
    let Vec2 { x, y } = spread[0] - 0.2;
    let block = format!("[[obstacles]]\nx_m = {x}\ny_m = {y}\nwidth_m = 0.4\nheight_m = 0.4");
    let blocked = starts(&block);
    assert!(!blocked.contains(&spread[0]));
    assert!(blocked.iter().all(|place| area.contains(*place)));
    assert_eq!(blocked[..4], spread[1..]);
}
