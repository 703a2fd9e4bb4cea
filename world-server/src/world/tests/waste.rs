//! Spills, gripper, deposit and report site.

use alliance_proto::ids::ItemId;
use alliance_proto::items::ItemCounts;
use alliance_proto::readings::SensedWaste;
use alliance_proto::scenario::Room;

use super::*;

const REACH_M: f32 = 0.2;

/// One item at the center of the upper spill, (4, 6), and robots where they are told.
fn one_item(starts: &[(f32, f32, f32)]) -> World {
    world(|scenario| {
        robots(starts)(scenario);
        scenario.waste.spills[0].items = 1;
        scenario.waste.spill_radius_m = 1e-5;
        scenario.body.reach_m = REACH_M;
    })
}

#[test]
fn items_start_in_their_spills() {
    let world = world(|_| {});
    assert_eq!(
        world.item_counts(),
        ItemCounts {
            in_spills: 24,
            ..ItemCounts::default()
        }
    );
    for (index, item) in world.items().iter().enumerate() {
        assert_eq!(item.id(), ItemId(index as u32));
        let spill = if index < 12 {
            Vec2::new(4.0, 6.0)
        } else {
            Vec2::new(4.0, 3.0)
        };
        assert!(item.position().distance(spill) <= 0.8);
    }
    assert!(!world.is_complete());
}

#[test]
fn the_seed_decides_where_the_items_are() {
    let places = |seed| {
        let world = World::new(&Setup::default_for(seed));
        world
            .items()
            .iter()
            .map(super::super::Item::position)
            .collect::<Vec<_>>()
    };
    assert_eq!(places(1), places(1));
    assert_ne!(places(1), places(2));
}

#[test]
fn a_mission_without_items_is_complete_at_once() {
    assert!(world(robots(&[(1.0, 1.0, 0.0)])).is_complete());
}

#[test]
fn carries_an_item_to_the_deposit() {
    // One item 0.3 m ahead of the robot, which the gripper reaches up to 0.4 m from the center.
    let mut world = one_item(&[(3.7, 6.0, 0.0)]);
    let item = ItemId(0);
    assert_eq!(
        world.step(&[gripper(Gripper::Pick)]),
        [WorldEvent::Picked { robot: BLUE, item }]
    );
    assert_eq!(world.carrying(BLUE), Some(item));
    assert_eq!(
        world.item_counts(),
        ItemCounts {
            carried: 1,
            ..ItemCounts::default()
        }
    );
    assert_eq!(world.readings(BLUE).waste, Some(SensedWaste::new()));
    assert_eq!(world.readings(BLUE).holding, Some(true));
    // A second pick changes nothing.
    assert_eq!(world.step(&[gripper(Gripper::Pick)]), []);

    let dropped = world.step(&[gripper(Gripper::Drop)]);
    let [
        WorldEvent::Dropped {
            robot: BLUE,
            item: ItemId(0),
            at,
        },
    ] = dropped[..]
    else {
        panic!("{dropped:?}");
    };
    // In front of the robot: radius, radius of the item and the skin.
    assert_at(at, 3.7 + 0.251, 6.0);
    assert_eq!(
        world.item_counts(),
        ItemCounts {
            on_floor: 1,
            ..ItemCounts::default()
        }
    );
    assert_eq!(world.step(&[gripper(Gripper::Drop)]), []);

    world.step(&[gripper(Gripper::Pick)]);
    let deposit = Vec2::new(9.6, 4.5);
    let way = deposit - position(&world, BLUE);
    world.step(&[drive(0.0, 0.0)]);
    let angle = libm::atan2f(way.y, way.x).to_degrees();
    for _ in 0..20 {
        world.step(&[drive(0.0, angle)]);
    }
    while position(&world, BLUE).distance(deposit) > 1.2 {
        world.step(&[drive(0.5, 0.0)]);
    }
    assert_eq!(
        world.step(&[gripper(Gripper::Drop)]),
        [WorldEvent::Delivered { robot: BLUE, item }]
    );
    assert_eq!(
        world.item_counts(),
        ItemCounts {
            delivered: 1,
            ..ItemCounts::default()
        }
    );
    assert!(world.is_complete());
    // It can be sensed there, but not taken out again.
    assert_eq!(world.readings(BLUE).waste.map(|waste| waste.len()), Some(1));
    assert_eq!(
        world.step(&[gripper(Gripper::Pick)]),
        [WorldEvent::PickFailed { robot: BLUE }]
    );
}

#[test]
fn the_gripper_reaches_from_the_edge_of_the_body() {
    let mut near = one_item(&[(3.6001, 6.0, 180.0)]);
    assert!(matches!(
        near.step(&[gripper(Gripper::Pick)])[..],
        [WorldEvent::Picked { .. }]
    ));
    let mut far = one_item(&[(3.5998, 6.0, 180.0)]);
    assert_eq!(
        far.step(&[gripper(Gripper::Pick)]),
        [WorldEvent::PickFailed { robot: BLUE }]
    );
}

#[test]
fn of_two_robots_that_pick_the_same_item_the_lower_rank_gets_it() {
    let mut world = one_item(&[(3.7, 6.0, 0.0), (4.3, 6.0, 180.0)]);
    let events = world.step(&[gripper(Gripper::Pick), gripper(Gripper::Pick)]);
    assert_eq!(
        events,
        [
            WorldEvent::Picked {
                robot: BLUE,
                item: ItemId(0)
            },
            WorldEvent::PickFailed { robot: GOLD },
        ]
    );
}

#[test]
fn the_gripper_works_where_the_robot_has_sensed_and_the_body_moves_after_that() {
    let mut world = one_item(&[(3.61, 6.0, 180.0)]);
    let command = Actuation {
        speed_m_s: 0.5,
        gripper: Gripper::Pick,
        ..Actuation::default()
    };
    assert_eq!(
        world.step(&[Some(command)]),
        [WorldEvent::Picked {
            robot: BLUE,
            item: ItemId(0)
        }]
    );
    assert_at(position(&world, BLUE), 3.585, 6.0);
}

#[test]
fn what_a_robot_at_a_wall_lets_go_falls_beside_it() {
    let mut world = world(|scenario| {
        robots(&[(3.7, 6.0, 0.0)])(scenario);
        scenario.waste.spills[0].items = 1;
        scenario.waste.spill_radius_m = 0.05;
        scenario.body.reach_m = 0.3;
    });
    world.step(&[gripper(Gripper::Pick)]);
    world.add_obstacle(&rectangle(3.95, 4.0, 0.5, 4.0, 0.0));
    let Some(WorldEvent::Dropped { at, .. }) = world.drop_carried(BLUE) else {
        panic!("it carried the item");
    };
    // The first direction, in steps of 22.5 degrees, in which the item clears the wall at x = 3.95.
    let angle = 45.0_f32.to_radians();
    assert_at(at, 3.7 + 0.251 * angle.cos(), 6.0 + 0.251 * angle.sin());
    assert_eq!(world.drop_carried(BLUE), None);
}

#[test]
fn an_item_let_go_in_a_corner_stays_inside_and_in_reach_of_others() {
    for (x, y, heading) in [
        (0.202, 0.202, 225.0),
        (0.202, 8.798, 135.0),
        (11.798, 0.202, -45.0),
    ] {
        let mut world = world(|scenario| {
            robots(&[(x, y, heading)])(scenario);
            scenario.waste.spills[0].items = 1;
            scenario.waste.spills[0].x_fraction = x / 12.0;
            scenario.waste.spills[0].y_fraction = y / 9.0;
            scenario.waste.spill_radius_m = 0.05;
        });
        world.step(&[gripper(Gripper::Pick)]);
        let Some(WorldEvent::Dropped { at, .. }) = world.drop_carried(BLUE) else {
            panic!("it carried the item");
        };
        let from_wall = at.min(Vec2::new(12.0, 9.0) - at).min_element();
        assert!(from_wall >= 0.05, "{at}");
        assert_eq!(world.item_counts().total(), 1);
    }
}

#[test]
fn a_spill_under_obstacles_moves_to_where_robots_can_get() {
    let covered = world(|scenario| {
        scenario.obstacles = vec![rectangle(3.0, 5.0, 2.0, 2.0, 0.0)];
    });
    assert_eq!(
        covered.item_counts(),
        ItemCounts {
            in_spills: 12,
            on_floor: 12,
            ..ItemCounts::default()
        }
    );
    for item in &covered.items()[..12] {
        let outside = (item.position() - Vec2::new(4.0, 6.0)).abs().max_element() - 1.0;
        assert!((0.05..0.2).contains(&outside), "{}", item.position());
    }
    // Nowhere at all: still as many items as there should be.
    let full = world(|scenario| {
        robots(&[(1.0, 1.0, 0.0)])(scenario);
        scenario.waste.spills[0].items = 3;
        scenario.room = Room {
            width_m: 2.0,
            height_m: 2.0,
        };
        scenario.obstacles = vec![
            rectangle(1.21, 0.0, 1.0, 2.0, 0.0),
            rectangle(0.0, 1.21, 2.0, 1.0, 0.0),
        ];
    });
    assert_eq!(full.item_counts().total(), 3);
}

#[test]
fn no_item_starts_where_it_fits_but_no_robot_can_grip_it() {
    // The spill lies in a slot of 0.3 m, 1 m from both of its ends; bodies are 0.4 m wide.
    let world = world(|scenario| {
        scenario.waste.spill_radius_m = 0.1;
        scenario.obstacles = vec![
            rectangle(3.0, 5.0, 0.85, 2.0, 0.0),
            rectangle(4.15, 5.0, 0.85, 2.0, 0.0),
        ];
    });
    let reach = 0.45;
    for item in &world.items()[..12] {
        let Vec2 { x, y } = item.position();
        let deep = (3.0..5.0).contains(&x) && (5.0 + reach..7.0 - reach).contains(&y);
        assert!(!deep, "({x}, {y})");
    }
}

#[test]
fn items_that_begin_in_the_deposit_are_delivered() {
    let world = world(|scenario| {
        for spill in &mut scenario.waste.spills {
            (spill.x_fraction, spill.y_fraction) = (0.8, 0.5);
        }
    });
    assert_eq!(
        world.item_counts(),
        ItemCounts {
            delivered: 24,
            ..ItemCounts::default()
        }
    );
    assert!(world.is_complete());
}

#[test]
fn a_report_counts_on_the_site_only_and_colors_it_for_a_while() {
    let report = Some(Actuation {
        report_progress: true,
        ..Actuation::default()
    });
    let mut away = world(robots(&[(3.0, 4.5, 0.0)]));
    assert_eq!(away.step(&[report]), []);
    assert_eq!((away.last_report(), away.site_colored()), (None, false));

    let mut world = world(robots(&[(0.3, 4.5, 0.0)]));
    world.step(&[None]);
    assert_eq!(
        world.step(&[report]),
        [WorldEvent::ReportMade { robot: BLUE }]
    );
    assert_eq!(world.last_report().map(|time| time.0), Some(50));
    // For 5 s.
    while world.now().0 < 5050 {
        assert!(world.site_colored());
        world.step(&[None]);
    }
    assert!(!world.site_colored());
}

#[test]
fn with_the_default_reach_a_dead_body_keeps_no_item_from_its_teammates() {
    // The body stands right on the item; a teammate comes as near as it can and reaches below it.
    let mut world = world(|scenario| {
        robots(&[(4.0, 6.0, 0.0), (3.5, 6.0, 0.0)])(scenario);
        scenario.waste.spills[0].items = 1;
        scenario.waste.spill_radius_m = 1e-5;
    });
    for _ in 0..20 {
        world.step(&[None, drive(0.5, 0.0)]);
    }
    let events = world.step(&[None, gripper(Gripper::Pick)]);
    assert!(matches!(
        events[..],
        [WorldEvent::Picked { robot: GOLD, .. }]
    ));
}
