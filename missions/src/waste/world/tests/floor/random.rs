//! Random rooms and commands at every step length: no overlap, no tunneling, no lost item, and reproducible results.

use proptest::prelude::*;
use proto::readings::Readings;
use run_log::recorder::EventKind;
use scenario::Room;
use scenario::ids::ItemId;
use world_server::world::{ObstacleId, Outline, start_poses};

use super::*;

const STEPS: usize = 40;
/// Rounding may reduce half of the skin, the minimum distance of a body from a solid.
pub(super) const LEAST_GAP_M: f32 = SKIN_M / 2.0 - 1e-5;

/// One robot's command in one step: speed, turn rate in degrees/s, gripper.
pub(super) type RandomActuation = Option<(f32, f32, u8)>;

pub(super) fn setups() -> impl Strategy<Value = Setup> {
    let penetrability = prop_oneof![3 => Just(0.0_f32), 1 => 0.11_f32..3.0];
    let obstacle = (
        -1.0_f32..8.0,
        -1.0_f32..8.0,
        0.01_f32..3.0,
        0.01_f32..3.0,
        penetrability,
    );
    let obstacles = prop::collection::vec(obstacle, 0..8);
    let room = (3.0_f32..8.0, 3.0_f32..8.0);
    let step_ms = prop::sample::select(vec![1_u64, 10, 50, 200, 500]);
    let team = (1_usize..6, 0.05_f32..0.3, 0.5_f32..5.0);
    (room, obstacles, step_ms, team, any::<u64>()).prop_filter_map(
        "the room is too small for the team",
        |((width_m, height_m), obstacles, step_ms, (count, radius_m, speed_m_s), seed)| {
            let mut setup = default_setup(seed);
            let scenario = &mut setup.scenario;
            scenario.room = Room::of_size(width_m, height_m);
            let obstacles = obstacles.into_iter();
            scenario.obstacles = obstacles
                .map(|(x, y, w, h, p)| rectangle(x, y, w, h, p))
                .collect();
            scenario.step_ms = step_ms;
            scenario.body.radius_m = radius_m;
            scenario.body.speed_m_s = speed_m_s;
            scenario.body.turn_deg_s = 360.0;
            let robot = |rank| Robot {
                name: format!("r{rank}"),
                side_sensor: true,
                ..Robot::default()
            };
            scenario.robots = (0..count).map(robot).collect();
            start_poses(scenario, (MISSION.world.start_area)(scenario), &[], &[])
                .is_ok()
                .then_some(setup)
        },
    )
}

/// Draws commands for at most six robots: long straight drives against solids, and a few turns.
pub(super) fn commands() -> impl Strategy<Value = Vec<Vec<RandomActuation>>> {
    let turn = prop_oneof![2 => Just(0.0_f32), 1 => -400.0_f32..400.0, 1 => Just(90.0_f32)];
    let command = prop::option::weighted(0.95, (-0.5_f32..6.0, turn, 0_u8..6));
    prop::collection::vec(prop::collection::vec(command, 6), STEPS)
}

pub(super) fn actuations(commands: &[RandomActuation]) -> Vec<Option<Actuation>> {
    let one = |command: &RandomActuation| {
        command.map(|(speed_m_s, turn_deg_s, grip)| Actuation {
            speed_m_s,
            turn_rad_s: turn_deg_s.to_radians(),
            action: ItemsAction {
                gripper: [Gripper::Keep, Gripper::Pick, Gripper::Drop][usize::from(grip).min(2)],
                report: grip == 5,
            }
            .into(),
        })
    };
    commands.iter().map(one).collect()
}

pub(super) fn solids(world: &World) -> Vec<Outline> {
    world.solids().collect()
}

/// Returns the smallest distance between a segment and a point, minus the radii.
fn gap(from: Vec2, to: Vec2, point: Vec2, radii: f32) -> f32 {
    let way = to - from;
    let share = (point - from).dot(way) / way.length_squared().max(f32::MIN_POSITIVE);
    (from + way * share.clamp(0.0, 1.0)).distance(point) - radii
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn nothing_overlaps_or_tunnels(setup in setups(), commands in commands()) {
        let mut world = World::new(&setup, MISSION.world);
        let solids = solids(&world);
        let radius_m = world.body().radius_m;
        let count = setup.scenario.robots.len();
        let robots = || (0..count).map(|rank| RobotId(rank as u32));
        for step in &commands {
            let before = robots().map(|robot| position(&world, robot)).collect::<Vec<_>>();
            world.step(&actuations(step));
            let after = robots().map(|robot| position(&world, robot)).collect::<Vec<_>>();
            for (rank, (&from, &to)) in before.iter().zip(&after).enumerate() {
                prop_assert!(to.is_finite());
                for solid in &solids {
                    // Points along the way, closer together than the width of a body.
                    let points = (from.distance(to) / radius_m) as usize * 2 + 1;
                    for point in 0..=points {
                        let at = from.lerp(to, point as f32 / points as f32);
                        let gap_m = solid.surface(at).0 - radius_m;
                        prop_assert!(gap_m >= LEAST_GAP_M, "robot {rank} at {at}: {gap_m} m from {solid:?}");
                    }
                }
                // A body passes the others at their current places: lower ranks have moved, higher ones have not.
                for other in 0..count {
                    let there = if other < rank { after[other] } else { before[other] };
                    if other != rank {
                        let gap_m = gap(from, to, there, 2.0 * radius_m);
                        prop_assert!(gap_m >= LEAST_GAP_M, "robots {rank} and {other}: {gap_m} m");
                    }
                }
            }
        }
    }

    #[test]
    fn the_center_beam_measures_how_far_the_body_can_move(setup in setups(), commands in commands()) {
        let mut setup = setup;
        setup.scenario.obstacles.retain(|obstacle| obstacle.penetrability <= 0.1);
        let range_m = setup.scenario.sensors.avoidance_range_m;
        let top_m_s = setup.scenario.body.speed_m_s;
        let step_s = setup.scenario.step_ms as f32 / 1000.0;
        let mut world = World::new(&setup, MISSION.world);
        for step in &commands {
            let mut actuations = actuations(step);
            if let Some(first) = &mut actuations[0] {
                first.turn_rad_s = 0.0;
            }
            let speed_m_s = actuations[0].map_or(0.0, |command| command.speed_m_s.clamp(0.0, top_m_s));
            let proximity = world.readings(BLUE).proximity.expect("every robot has the sensor");
            let free_m = proximity.ahead[1].map_or(range_m, |hit| hit.distance_m);
            let from = position(&world, BLUE);
            world.step(&actuations);
            let moved_m = position(&world, BLUE).distance(from);
            let wanted_m = speed_m_s * step_s;
            if wanted_m <= range_m {
                prop_assert!((moved_m - wanted_m.min(free_m)).abs() < 1e-5, "{moved_m} of {wanted_m}, free {free_m}");
            }
            // The next round uses another heading.
            let turn = step[0].map(|(_, turn, _)| drive(0.0, turn)).unwrap_or_default();
            world.step(&[turn]);
        }
    }

    #[test]
    fn items_are_neither_lost_nor_duplicated(setup in setups(), commands in commands()) {
        let mut setup = setup;
        // Everything lies close together, so that robots often pick up, drop and deliver items.
        WasteSection::of_mut(&mut setup.scenario).deposit.x_fraction = 0.3;
        WasteSection::of_mut(&mut setup.scenario).spill_radius_m = 2.0;
        let mut world = World::new(&setup, MISSION.world);
        let robots = setup.scenario.robots.len() as u32;
        let mut delivered = world.item_counts().delivered;
        for (index, step) in commands.iter().enumerate() {
            let events = world.step(&actuations(step));
            let put_down = if index % 7 == 0 { world.release_load(BLUE) } else { Vec::new() };
            let counts = world.item_counts();
            prop_assert_eq!(counts.total(), 24);
            let mut carried = (0..robots).filter_map(|rank| world.carrying(RobotId(rank))).collect::<Vec<_>>();
            carried.sort();
            carried.dedup();
            prop_assert_eq!(carried.len(), counts.carried as usize);
            delivered += events.iter().chain(&put_down).filter(|event| event.kind == EventKind::Mission("delivered")).count() as u32;
            prop_assert_eq!(counts.delivered, delivered);
            prop_assert_eq!(world.is_complete(), delivered == 24);
            for (id, item) in world.items().iter().enumerate() {
                let size = world.room().size();
                prop_assert!(item.position.cmpge(Vec2::ZERO).all() && item.position.cmple(size).all());
                // An item falls on no solid, unless no other place existed at the start.
                if events.iter().any(|event| event.kind == EventKind::Mission("dropped") && event.subject == format!("item-{id}")) {
                    prop_assert!(solids(&world).iter().all(|solid| solid.surface(item.position).0 > 0.0));
                }
            }
        }
    }

    /// Caches of a robot's surroundings never change its readings or movement, for any changes and any query pattern.
    #[test]
    fn cached_surroundings_match_a_fresh_computation(
        setup in setups(),
        commands in commands(),
        changes in prop::collection::vec((0_u32..24, 0_u32..6, 0.0_f32..1.0, 0.0_f32..1.0), STEPS),
        wider in 1.0_f32..5.0,
        waste_range_m in prop::sample::select(vec![0.0_f32, 0.3, 1.0]),
    ) {
        let mut setup = setup;
        setup.scenario.room.width_m *= wider;
        setup.scenario.sensors.item_range_m = waste_range_m;
        WasteSection::of_mut(&mut setup.scenario).spill_radius_m = 2.0;
        let mut world = World::new(&setup, MISSION.world);
        let robots = setup.scenario.robots.len() as u32;
        let anew = |world: &World| {
            let mut anew = world.clone();
            anew.clear_caches();
            anew
        };
        let mut sensed = vec![Readings::default(); robots as usize];
        for (step, (change, target, x, y)) in commands.iter().zip(changes) {
            // Most robots stand still, so that their caches stay valid while nothing comes near.
            let mut actuations = actuations(step);
            for (rank, actuation) in (0..).zip(&mut actuations) {
                *actuation = actuation.filter(|_| (rank + target) % 4 == 0);
            }
            let (robot, at) = (RobotId(target % robots), Vec2::new(x, y) * world.room().size());
            match change {
                0 => { let _ = world.move_robot(robot, at, None); }
                1 => { world.remove_robot(robot); }
                2 => { let _ = world.add_robot(robot); }
                3 => { let _ = world.add_item(at); }
                4 => { let _ = world.move_item(ItemId(target), at); }
                5 => { world.release_load(robot); }
                6 => { world.add_obstacle(&rectangle(at.x, at.y, 1.0, 1.0, x)); }
                7 => { world.remove_obstacle(ObstacleId(target)); }
                _ => {}
            }
            let fresh = anew(&world);
            for (robot, sensed) in (0..robots).map(RobotId).zip(&mut sensed) {
                if !world.readings_are_valid(robot) {
                    world.write_readings(robot, sensed);
                }
                prop_assert!(!world.is_present(robot) || *sensed == fresh.readings(robot));
            }
            let asked = (0..robots).filter(|rank| (rank + change) % 3 > 0).map(RobotId);
            for robot in asked.filter(|robot| world.is_present(*robot)) {
                prop_assert_eq!(world.readings(robot), fresh.readings(robot));
            }
            let mut fresh = anew(&world);
            prop_assert_eq!(world.step(&actuations), fresh.step(&actuations));
            for robot in (0..robots).map(RobotId) {
                prop_assert_eq!(world.pose(robot), fresh.pose(robot));
            }
        }
    }
}
