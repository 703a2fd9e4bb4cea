//! Changes between steps, individually and in random order.

use crate::waste::data::WasteSection;
use proptest::prelude::*;
use scenario::Energy;
use scenario::ids::ItemId;

use super::random::{LEAST_GAP_M, RandomActuation, actuations, commands, setups, solids};
use super::*;
use crate::waste::world::PlaceError;
use crate::waste::world::tests::dropped_at;
use world_server::world::{ChangeError, ComponentId, ObstacleId, Outline};

fn ids(world: &World) -> Vec<u32> {
    let ids = world.obstacles().iter().map(|obstacle| obstacle.id);
    let ids = ids.map(|id| match id {
        ComponentId::Obstacle(ObstacleId(id)) => id,
        other => panic!("{other} is not an obstacle"),
    });
    ids.collect()
}

#[test]
fn obstacles_keep_their_order_and_their_ids() {
    let mut world = world(|scenario| {
        scenario.obstacles = vec![rectangle(5.0, 5.0, 1.0, 1.0, 0.0)];
    });
    for x in [6.0, 7.0, 8.0] {
        world.add_obstacle(&rectangle(x, 5.0, 0.5, 0.5, 0.0));
    }
    assert!(world.remove_obstacle(ObstacleId(1)));
    assert!(world.remove_obstacle(ObstacleId(3)));
    assert!(!world.remove_obstacle(ObstacleId(1)));
    assert_eq!(ids(&world), [0, 2]);
    let new = world.add_obstacle(&rectangle(9.0, 5.0, 0.5, 0.5, 0.0));
    assert_eq!(new, ObstacleId(4));
    assert_eq!(ids(&world), [0, 2, 4]);
}

#[test]
fn a_removed_obstacle_lets_the_robot_pass() {
    let mut world = world(robots(&[(1.0, 4.0, 0.0)]));
    let obstacle = world.add_obstacle(&rectangle(1.5, 3.5, 0.5, 1.0, 0.0));
    for _ in 0..40 {
        world.step(&[drive(0.5, 0.0)]);
    }
    assert_near(position(&world, BLUE).x, 1.299);
    world.remove_obstacle(obstacle);
    for _ in 0..40 {
        world.step(&[drive(0.5, 0.0)]);
    }
    assert_near(position(&world, BLUE).x, 2.299);
}

#[test]
fn new_waste_lies_where_it_can_be_gripped_and_counts() {
    let mut world = world(|scenario| {
        robots(&[(1.0, 1.0, 0.0)])(scenario);
        scenario.obstacles = vec![rectangle(5.0, 4.0, 2.0, 2.0, 0.0)];
    });
    assert_eq!(world.add_item(Vec2::new(8.0, 7.0)), Ok(ItemId(0)));
    assert_at(world.items()[0].position, 8.0, 7.0);
    assert!(!world.is_complete());
    // An item cannot lie on the obstacle or outside the border, and avoids another item.
    for near in [
        Vec2::new(6.0, 5.0),
        Vec2::new(-3.0, 4.0),
        Vec2::new(8.0, 7.0),
    ] {
        world.add_item(near).unwrap();
    }
    let places: Vec<Vec2> = world.items().iter().map(|item| item.position).collect();
    assert!(!Outline::contains(
        &Outline::Rectangle {
            min: Vec2::new(4.95, 3.95),
            max: Vec2::new(7.05, 6.05)
        },
        places[1]
    ));
    assert!(
        places[1].distance(Vec2::new(6.0, 5.0)) < 1.3,
        "{}",
        places[1]
    );
    assert!(places[2].x >= 0.05 && places[2].x < 0.5, "{}", places[2]);
    assert_near(places[3].distance(places[0]), 0.1);
    assert_eq!(world.item_counts().on_floor, 4);
    // An item added in the deposit counts as delivered.
    world.add_item(Vec2::new(9.6, 4.5)).unwrap();
    assert_eq!(world.item_counts().delivered, 1);
    assert_eq!(world.item_counts().total(), 5);
    assert!(!world.is_complete());
}

#[test]
fn no_item_is_added_if_no_place_is_reachable() {
    let mut world = world(robots(&[(1.0, 1.0, 0.0)]));
    world.add_obstacle(&rectangle(0.0, 0.0, 12.0, 9.0, 0.0));
    assert_eq!(
        world.add_item(Vec2::new(6.0, 5.0)),
        Err(PlaceError::NoPlace)
    );
    assert_eq!(world.item_counts().total(), 0);
}

#[test]
fn only_items_on_the_floor_can_be_moved() {
    let mut world = world(robots(&[(3.0, 3.0, 0.0)]));
    let carried = world.add_item(Vec2::new(3.0, 3.0)).unwrap();
    world.step(&[gripper(Gripper::Pick)]);
    let floor = world.add_item(Vec2::new(6.0, 7.0)).unwrap();
    let delivered = world.add_item(Vec2::new(9.6, 4.5)).unwrap();
    let to = Vec2::new(5.0, 2.0);
    assert_eq!(
        world.move_item(carried, to),
        Err(PlaceError::Carried(carried))
    );
    assert_eq!(
        world.move_item(delivered, to),
        Err(PlaceError::Delivered(delivered))
    );
    assert_eq!(
        world.move_item(ItemId(3), to),
        Err(PlaceError::NoItem(ItemId(3)))
    );
    assert_eq!(world.move_item(floor, to), Ok(to));
    assert_eq!(world.items()[1].position, to);
    // The item does not block its own place.
    assert_eq!(world.move_item(floor, to), Ok(to));
    assert_eq!(world.item_counts().total(), 3);
}

#[test]
fn a_robot_can_be_moved_to_a_free_place_only() {
    let mut world = world(robots(&[(3.0, 3.0, 90.0), (5.0, 3.0, 0.0)]));
    world.add_obstacle(&rectangle(7.0, 3.0, 1.0, 1.0, 0.0));
    let before = world.pose(BLUE);
    for taken in [(5.3, 3.0), (6.9, 3.5), (0.1, 4.0), (-4.0, 4.0), (7.5, 3.5)] {
        let to = Vec2::from(taken);
        assert_eq!(world.move_robot(BLUE, to, None), Err(ChangeError::Occupied));
        assert_eq!(world.pose(BLUE), before);
    }
    world.move_robot(BLUE, Vec2::new(5.4, 3.0), None).unwrap();
    assert_eq!(world.pose(BLUE).heading_rad, before.heading_rad);
    // The robot's own body does not block the place.
    world
        .move_robot(BLUE, Vec2::new(5.5, 3.0), Some(4.0))
        .unwrap();
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
    assert_eq!(
        world.move_robot(GOLD, Vec2::new(6.0, 6.0), None),
        Err(ChangeError::Absent)
    );
    assert_eq!(world.add_robot(BLUE), Err(ChangeError::Present));
    // An absent robot executes no command.
    world.step(&[drive(0.5, 0.0), drive(0.5, 0.0)]);
    assert_at(position(&world, GOLD), 3.1, 3.0);
    assert_near(position(&world, BLUE).x, 3.025);
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
fn an_absent_robot_is_not_added_without_room() {
    let mut world = world(|scenario| {
        robots(&[(3.0, 3.0, 0.0), (5.0, 3.0, 0.0)])(scenario);
        scenario.robots[1].absent = true;
    });
    let lid = world.add_obstacle(&rectangle(0.0, 0.0, 12.0, 9.0, 0.0));
    assert_eq!(world.add_robot(GOLD), Err(ChangeError::NoRoom));
    assert!(!world.is_present(GOLD));
    world.remove_obstacle(lid);
    assert_at(world.add_robot(GOLD).unwrap().position, 5.0, 3.0);
}

#[test]
fn the_load_of_a_removed_robot_falls_and_is_kept() {
    let mut world = world(robots(&[(3.0, 3.0, 0.0), (6.0, 3.0, 180.0)]));
    let item = world.add_item(Vec2::new(6.0, 3.0)).unwrap();
    world.step(&[None, gripper(Gripper::Pick)]);
    assert_eq!(world.carrying(GOLD), Some(item));
    let at = dropped_at(&world.remove_robot(GOLD));
    assert_eq!(world.items()[0].position, at);
    assert_eq!(world.carrying(GOLD), None);
    assert_eq!(world.item_counts().on_floor, 1);
    // The body is gone, so blue passes.
    for _ in 0..160 {
        world.step(&[drive(0.5, 0.0)]);
    }
    assert!((position(&world, BLUE).x - 7.0).abs() < 1e-3);
}

#[test]
fn a_body_without_power_executes_no_command_and_draws_no_energy() {
    let mut world = world(|scenario| {
        robots(&[(3.0, 3.0, 0.0)])(scenario);
        scenario.energy = Some(Energy::default());
    });
    world.set_powered(BLUE, false);
    world.step(&[drive(0.5, 90.0)]);
    assert_at(position(&world, BLUE), 3.0, 3.0);
    assert_eq!(world.energy_j(BLUE), Some(50_000.0));
    world.set_powered(BLUE, true);
    world.step(&[drive(0.5, 0.0)]);
    assert_near(position(&world, BLUE).x, 3.025);
    assert!(world.energy_j(BLUE).unwrap() < 50_000.0);
}

/// A change of the world between two steps.
#[derive(Clone, Debug)]
enum Change {
    AddObstacle(f32, f32, f32, f32),
    RemoveObstacle(u32),
    AddItem(f32, f32),
    MoveItem(u32, f32, f32),
    MoveRobot(u16, f32, f32),
    AddRobot(u16),
    RemoveRobot(u16),
    Power(u16, bool),
}

fn changes() -> impl Strategy<Value = Vec<(Change, Vec<RandomActuation>)>> {
    let place = || -1.0_f32..9.0;
    let robot = || 0_u16..6;
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
    let present = || (0..count).filter(|rank| world.is_present(RobotId(*rank as u16)));
    let mut gaps = Vec::new();
    for rank in present() {
        let at = position(world, RobotId(rank as u16));
        for solid in solids(world) {
            gaps.push((
                rank,
                format!("{solid:?}"),
                solid.surface(at).0 - world.body().radius_m,
            ));
        }
        for other in present().filter(|other| *other != rank) {
            let apart = at.distance(position(world, RobotId(other as u16)));
            gaps.push((
                rank,
                format!("robot {other}"),
                apart - 2.0 * world.body().radius_m,
            ));
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
            let robot = |rank: u16| RobotId(rank % count as u16);
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
            let mut carried = (0..count as u16).filter_map(|rank| {
                let item = world.carrying(RobotId(rank))?;
                Some((item, RobotId(rank)))
            }).collect::<Vec<_>>();
            carried.sort();
            let items = (0..).map(ItemId).zip(world.items());
            let carriers = items.filter_map(|(id, item)| Some((id, item.carrier?)));
            prop_assert_eq!(&carried, &carriers.collect::<Vec<_>>());
            prop_assert!(carried.iter().all(|(_, robot)| world.is_present(*robot)));
            for item in world.items() {
                let inside = item.position.cmpge(Vec2::ZERO).all() && item.position.cmple(world.size()).all();
                prop_assert!(inside, "{item:?}");
            }
            let ids = ids(&world);
            prop_assert!(ids.windows(2).all(|two| two[0] < two[1]), "{ids:?}");
        }
    }
}
