//! Changes between steps, individually and in random order.

use proptest::prelude::*;
use scenario::ids::ItemId;
use world_server::world::{ChangeError, ComponentId, ObstacleId};

use super::random::{LEAST_GAP_M, RandomActuation, actuations, commands, setups, solids};
use super::*;
use crate::waste::world::PlaceError;
use crate::waste::world::tests::dropped_at;

fn ids(world: &World) -> Vec<u32> {
    let ids = world.obstacles().iter().map(|obstacle| match obstacle.id {
        ComponentId::Obstacle(ObstacleId(id)) => id,
        other => panic!("{other} is not an obstacle"),
    });
    ids.collect()
}

#[test]
fn obstacles_keep_their_order_and_their_ids() {
    let mut world = room(&[(1.0, 1.0, 0.0)], &[solid(5.0, 5.0, 1.0, 1.0)]);
    for x in [6.0, 7.0, 8.0] {
        world.add_obstacle(&solid(x, 5.0, 0.5, 0.5));
    }
    for (id, is_there) in [(1, true), (3, true), (1, false)] {
        assert_eq!(world.remove_obstacle(ObstacleId(id)), is_there);
    }
    assert_eq!(ids(&world), [0, 2]);
    let new = world.add_obstacle(&solid(9.0, 5.0, 0.5, 0.5));
    assert_eq!((new, ids(&world)), (ObstacleId(4), vec![0, 2, 4]));
}

#[test]
fn a_removed_obstacle_lets_the_robot_pass() {
    let mut world = room(&[(1.0, 4.0, 0.0)], &[]);
    let obstacle = world.add_obstacle(&solid(1.5, 3.5, 0.5, 1.0));
    run(&mut world, 40, &[drive(0.5, 0.0)]);
    assert_near(position(&world, BLUE).x, 1.299);
    world.remove_obstacle(obstacle);
    run(&mut world, 40, &[drive(0.5, 0.0)]);
    assert_near(position(&world, BLUE).x, 2.299);
}

#[test]
fn new_waste_lies_where_it_can_be_gripped_and_counts() {
    let mut world = room(&[(1.0, 1.0, 0.0)], &[solid(5.0, 4.0, 2.0, 2.0)]);
    // An item cannot lie on the obstacle or outside the border, and avoids another item.
    for (id, near) in [(8.0, 7.0), (6.0, 5.0), (-3.0, 4.0), (8.0, 7.0)]
        .iter()
        .enumerate()
    {
        let added = world.add_item(Vec2::from(*near));
        assert_eq!(added, Ok(ItemId(id as u32)));
        assert!(!world.is_complete());
    }
    let items = world.items().iter().map(|item| item.position);
    let [first, beside, inside, apart] = items.collect::<Vec<_>>()[..] else {
        panic!("four items");
    };
    assert_at(first, 8.0, 7.0);
    let from_obstacle = (beside - beside.clamp(Vec2::new(5.0, 4.0), Vec2::new(7.0, 6.0))).length();
    assert!(from_obstacle >= 0.05 - 1e-5, "{beside}");
    assert!(beside.distance(Vec2::new(6.0, 5.0)) < 1.3, "{beside}");
    assert!((0.05..0.5).contains(&inside.x), "{inside}");
    assert_near(apart.distance(first), 0.1);
    assert_eq!(world.item_counts().on_floor, 4);
    // An item added in the deposit counts as delivered.
    world.add_item(Vec2::new(9.6, 4.5)).unwrap();
    let counts = world.item_counts();
    assert_eq!((counts.delivered, counts.total()), (1, 5));
    assert!(!world.is_complete());
    // No item is added if no place is reachable.
    world.add_obstacle(&solid(0.0, 0.0, 12.0, 9.0));
    let refused = world.add_item(Vec2::new(6.0, 5.0));
    assert_eq!(refused, Err(PlaceError::NoPlace));
    assert_eq!(world.item_counts(), counts);
}

#[test]
fn only_items_on_the_floor_can_be_moved() {
    let mut world = room(&[(3.0, 3.0, 0.0)], &[]);
    let carried = world.add_item(Vec2::new(3.0, 3.0)).unwrap();
    world.step(&[acts(Gripper::Pick)]);
    let floor = world.add_item(Vec2::new(6.0, 7.0)).unwrap();
    let delivered = world.add_item(Vec2::new(9.6, 4.5)).unwrap();
    let to = Vec2::new(5.0, 2.0);
    for (item, expected) in [
        (carried, Err(PlaceError::Carried(carried))),
        (delivered, Err(PlaceError::Delivered(delivered))),
        (ItemId(3), Err(PlaceError::NoItem(ItemId(3)))),
        (floor, Ok(to)),
        // The item does not block its own place.
        (floor, Ok(to)),
    ] {
        assert_eq!(world.move_item(item, to), expected);
    }
    assert_eq!(world.items()[1].position, to);
    assert_eq!(world.item_counts().total(), 3);
}

#[test]
fn a_robot_can_be_moved_to_a_free_place_only() {
    let obstacle = solid(7.0, 3.0, 1.0, 1.0);
    let mut world = room(&[(3.0, 3.0, 90.0), (5.0, 3.0, 0.0)], &[obstacle]);
    let before = world.pose(BLUE);
    for taken in [(5.3, 3.0), (6.9, 3.5), (0.1, 4.0), (-4.0, 4.0), (7.5, 3.5)] {
        let moved = world.move_robot(BLUE, Vec2::from(taken), None);
        assert_eq!(moved, Err(ChangeError::Occupied));
        assert_eq!(world.pose(BLUE), before);
    }
    world.move_robot(BLUE, Vec2::new(5.4, 3.0), None).unwrap();
    assert_eq!(world.pose(BLUE).heading_rad, before.heading_rad);
    // The robot's own body does not block the place.
    let moved = world.move_robot(BLUE, Vec2::new(5.5, 3.0), Some(4.0));
    moved.unwrap();
    assert_near(world.pose(BLUE).heading_rad, 4.0 - std::f32::consts::TAU);
    assert_at(position(&world, BLUE), 5.5, 3.0);
}

#[test]
fn an_absent_robot_blocks_nothing_and_appears_at_its_start() {
    let mut world = world(|scenario| {
        robots(&[(3.0, 3.0, 0.0), (3.1, 3.0, 90.0)])(scenario);
        scenario.robots[1].absent = true;
    });
    assert!(!world.is_present(GOLD));
    let proximity = world.readings(BLUE).proximity.unwrap();
    assert_eq!(proximity.ahead, [None; 3]);
    let moved = world.move_robot(GOLD, Vec2::new(6.0, 6.0), None);
    assert_eq!(moved, Err(ChangeError::Absent));
    assert_eq!(world.add_robot(BLUE), Err(ChangeError::Present));
    // An absent robot executes no command.
    world.step(&[drive(0.5, 0.0), drive(0.5, 0.0)]);
    assert_at(position(&world, GOLD), 3.1, 3.0);
    assert_near(position(&world, BLUE).x, 3.025);
    // It is not added without room.
    let lid = world.add_obstacle(&solid(0.0, 0.0, 12.0, 9.0));
    assert_eq!(world.add_robot(GOLD), Err(ChangeError::NoRoom));
    assert!(!world.is_present(GOLD));
    world.remove_obstacle(lid);
    // The start is occupied, so the robot appears at the nearest free place.
    let came = world.add_robot(GOLD).unwrap();
    let apart = came.position.distance(position(&world, BLUE));
    assert!((0.4..0.6).contains(&apart), "{came:?}");
    assert_near(came.heading_rad, std::f32::consts::FRAC_PI_2);
    assert!(world.is_present(GOLD));
    // The robot appears at its start if that is free.
    assert_eq!(world.remove_robot(GOLD), []);
    world.move_robot(BLUE, Vec2::new(6.0, 6.0), None).unwrap();
    assert_at(world.add_robot(GOLD).unwrap().position, 3.1, 3.0);
}

#[test]
fn the_load_of_a_removed_robot_falls_and_is_kept() {
    let mut world = room(&[(3.0, 3.0, 0.0), (6.0, 3.0, 180.0)], &[]);
    let item = world.add_item(Vec2::new(6.0, 3.0)).unwrap();
    world.step(&[None, acts(Gripper::Pick)]);
    assert_eq!(world.carrying(GOLD), Some(item));
    let at = dropped_at(&world.remove_robot(GOLD));
    assert_eq!(world.items()[0].position, at);
    assert_eq!(world.carrying(GOLD), None);
    assert_eq!(world.item_counts().on_floor, 1);
    // The body is gone, so blue passes.
    run(&mut world, 160, &[drive(0.5, 0.0)]);
    assert!((position(&world, BLUE).x - 7.0).abs() < 1e-3);
}

/// A change of the world between two steps.
#[derive(Clone, Debug)]
enum Change {
    AddObstacle(f32, f32, f32, f32),
    RemoveObstacle(u32),
    AddItem(f32, f32),
    MoveItem(u32, f32, f32),
    MoveRobot(u32, f32, f32),
    AddRobot(u32),
    RemoveRobot(u32),
    Power(u32, bool),
}

fn changes() -> impl Strategy<Value = Vec<(Change, Vec<RandomActuation>)>> {
    let place = || -1.0_f32..9.0;
    let robot = || 0_u32..6;
    let change = prop_oneof![
        (place(), place(), 0.05_f32..1.5, 0.05_f32..1.5)
            .prop_map(|(x, y, w, h)| Change::AddObstacle(x, y, w, h)),
        (0_u32..12).prop_map(Change::RemoveObstacle),
        (place(), place()).prop_map(|(x, y)| Change::AddItem(x, y)),
        (0_u32..40, place(), place()).prop_map(|(item, x, y)| Change::MoveItem(item, x, y)),
        (robot(), place(), place()).prop_map(|(robot, x, y)| Change::MoveRobot(robot, x, y)),
        robot().prop_map(Change::AddRobot),
        robot().prop_map(Change::RemoveRobot),
        (robot(), any::<bool>()).prop_map(|(robot, on)| Change::Power(robot, on)),
    ];
    (prop::collection::vec(change, 40), commands())
        .prop_map(|(changes, commands)| changes.into_iter().zip(commands).collect())
}

/// Returns the distance from each body to everything solid to it, with the id of the solid. Negative for an overlap.
fn gaps(world: &World, count: usize) -> Vec<(usize, String, f32)> {
    let radius_m = world.body().radius_m;
    let present = || (0..count).filter(|rank| world.is_present(RobotId(*rank as u32)));
    let mut gaps = Vec::new();
    for rank in present() {
        let at = position(world, RobotId(rank as u32));
        let to_solids = solids(world).into_iter();
        gaps.extend(
            to_solids.map(|solid| (rank, format!("{solid:?}"), solid.surface(at).0 - radius_m)),
        );
        for other in present().filter(|other| *other != rank) {
            let apart = at.distance(position(world, RobotId(other as u32)));
            gaps.push((rank, format!("robot {other}"), apart - 2.0 * radius_m));
        }
    }
    gaps
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn random_changes_cause_no_new_overlap_and_lose_no_item(setup in setups(), steps in changes()) {
        let mut setup = setup;
        WasteSection::of_mut(&mut setup.scenario).deposit.x_fraction = 0.3;
        let count = setup.scenario.robots.len();
        let mut world = World::new(&setup, MISSION.world);
        let mut items = world.item_counts().total();
        for (change, commands) in &steps {
            let robot = |rank: u32| RobotId(rank % count as u32);
            let before = gaps(&world, count);
            match *change {
                Change::AddObstacle(x, y, w, h) => {
                    world.add_obstacle(&rectangle(x, y, w, h, 0.0));
                }
                Change::RemoveObstacle(id) => {
                    world.remove_obstacle(ObstacleId(id));
                }
                Change::AddItem(x, y) => items += u32::from(world.add_item(Vec2::new(x, y)).is_ok()),
                Change::MoveItem(item, x, y) => {
                    let _ = world.move_item(ItemId(item), Vec2::new(x, y));
                }
                Change::MoveRobot(rank, x, y) => {
                    let _ = world.move_robot(robot(rank), Vec2::new(x, y), None);
                }
                Change::AddRobot(rank) => {
                    let _ = world.add_robot(robot(rank));
                }
                Change::RemoveRobot(rank) => {
                    world.remove_robot(robot(rank));
                }
                Change::Power(rank, on) => world.set_powered(robot(rank), on),
            }
            let changed = gaps(&world, count);
            if !matches!(change, Change::AddObstacle(..)) {
                for (rank, solid, gap_m) in &changed {
                    let old = before.iter().find(|(r, s, _)| r == rank && s == solid);
                    let least = old.map_or(0.0, |(_, _, old)| old.min(0.0));
                    prop_assert!(*gap_m >= least - 2e-5, "{change:?}: robot {rank} {gap_m} m from {solid}");
                }
            }
            world.step(&actuations(commands));
            for (rank, solid, gap_m) in gaps(&world, count) {
                let old = changed.iter().find(|(r, s, _)| *r == rank && *s == solid);
                let least = old.map_or(LEAST_GAP_M, |(_, _, old)| old.min(LEAST_GAP_M));
                prop_assert!(gap_m >= least - 2e-5, "after {change:?}: robot {rank} {gap_m} m from {solid}");
            }

            let counts = world.item_counts();
            prop_assert_eq!(counts.total(), items);
            prop_assert_eq!(world.items().len() as u32, items);
            prop_assert_eq!(world.is_complete(), items > 0 && counts.delivered == items);
            let mut carried = (0..count as u32).filter_map(|rank| {
                let item = world.carrying(RobotId(rank))?;
                Some((item, RobotId(rank)))
            }).collect::<Vec<_>>();
            carried.sort();
            let items = (0..).map(ItemId).zip(world.items());
            let carriers = items.filter_map(|(id, item)| Some((id, item.carrier?)));
            prop_assert_eq!(&carried, &carriers.collect::<Vec<_>>());
            prop_assert!(carried.iter().all(|(_, robot)| world.is_present(*robot)));
            for item in world.items() {
                let inside = world.room().contains(item.position);
                prop_assert!(inside, "{item:?}");
            }
            let ids = ids(&world);
            prop_assert!(ids.windows(2).all(|two| two[0] < two[1]), "{ids:?}");
        }
    }
}
