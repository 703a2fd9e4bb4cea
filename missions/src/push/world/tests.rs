//! Bars that bodies push by command, and an independent physical model for comparison.

use proptest::prelude::*;
use proto::readings::Actuation;
use run_log::recorder::EventKind;
use scenario::Setup;
use world_server::world::World;

use super::*;
use crate::fixtures::{parse, resolve};
use crate::push::MISSION;

/// A place behind the left part of the bar.
const LEFT: (f32, f32, f32) = (2.6, 5.5, 0.0);

/// A bar at x = 3 in a room of 12 × 9 m, and robots with these starts: x, y and heading in degrees.
fn setup(starts: &[(f32, f32, f32)], more: &str) -> Setup {
    let mut text =
        format!("step_ms = 50\n{more}\n[push]\n[[push.bars]]\nx_m = 3\ny_m = 4.5\ngoal_x_m = 9\n");
    for (index, (x, y, heading)) in starts.iter().enumerate() {
        text += &format!(
            "[[robots]]\nname = 'r{index}'\nstart = {{ x_m = {x}, y_m = {y}, heading_deg = {heading} }}\n"
        );
    }
    resolve(parse(&text))
}

fn world(starts: &[(f32, f32, f32)]) -> World {
    World::new(&setup(starts, ""), MISSION.world)
}

/// Drives those robots straight ahead for `steps` steps and returns the events. The others stand still.
fn drive(world: &mut World, robots: &[usize], steps: usize) -> Vec<(String, String)> {
    let mut events = Vec::new();
    for _ in 0..steps {
        let mut commands = vec![None; world.robot_count()];
        for robot in robots {
            commands[*robot] = Some(Actuation {
                speed_m_s: 0.5,
                ..Actuation::default()
            });
        }
        for event in world.step(&commands) {
            if let EventKind::Mission(kind) = event.kind {
                events.push((kind.to_owned(), event.reason));
            }
        }
        world.mission().check_invariants(world).unwrap();
    }
    events
}

/// Returns the point about which a push far from the middle turns a rod, from friction on many pieces of the rod. It
/// is the point for which the push does the least work against friction.
fn by_least_work(along_m: f64, length_m: f64) -> f64 {
    const PIECES: usize = 4000;
    let work = |pivot_m: f64| -> f64 {
        let pieces = (0..PIECES).map(|piece| (piece as f64 + 0.5) / PIECES as f64 - 0.5);
        let ways = pieces.map(|share| (share * length_m - pivot_m).abs());
        ways.sum::<f64>() / (along_m - pivot_m).abs()
    };
    let candidates = (1..4000).map(|step| -f64::from(step) / 4000.0 * length_m * 1.5);
    candidates
        .min_by(|a, b| work(*a).total_cmp(&work(*b)))
        .unwrap()
}

#[test]
fn a_rod_turns_about_the_point_of_least_work() {
    for along_m in [0.4, 0.6, 0.9, 1.1, 1.2_f32] {
        let found = pivot_of(along_m, 2.4);
        let expected = by_least_work(along_m.into(), 2.4);
        assert!(
            (f64::from(found) - expected).abs() < 0.005,
            "{along_m}: {found} {expected}"
        );
        assert_eq!(pivot_of(-along_m, 2.4), -found);
    }
    // Published result: a push at the end turns the rod about the point L/√2 from there, and the other end moves back
    // by √2 - 1.
    let from_end_m = 1.2 - pivot_of(1.2, 2.4);
    assert!((from_end_m - 2.4 / std::f32::consts::SQRT_2).abs() < 1e-5);
    let back = (2.4 - from_end_m) / from_end_m;
    assert!((back - (std::f32::consts::SQRT_2 - 1.0)).abs() < 1e-5);
}

/// The bar crosses its earlier axis at the point about which it has turned.
#[test]
fn a_bar_without_a_holder_turns_about_that_point() {
    let mut world = world(&[(2.6, 5.6, 0.0)]);
    drive(&mut world, &[0], 6);
    let before = world.bars()[0];
    drive(&mut world, &[0], 10);
    let after = world.bars()[0];
    assert!(after.from.x > before.from.x && after.to.x < before.to.x);
    let share =
        (after.from.x - before.from.x) / (after.from.x - before.from.x + before.to.x - after.to.x);
    let from_end_m = 2.4 * share;
    // The body pushes 0.1 m from the end.
    let expected = 1.2 - by_least_work(1.1, 2.4) as f32;
    assert!(
        (from_end_m - expected).abs() < 0.02,
        "{from_end_m} {expected}"
    );
}

/// A body behind the other end holds it.
#[test]
fn a_body_holds_the_other_end() {
    let mut world = world(&[LEFT, (2.698, 3.5, 0.0)]);
    drive(&mut world, &[0], 12);
    let bar = world.bars()[0];
    // The bar turns about the place where it is held, 0.2 m from its end.
    let forward_m = bar.from.x - 3.0;
    let back_m = 3.0 - bar.to.x;
    assert!(forward_m > 0.05);
    assert!(
        (back_m / forward_m - 0.2 / 2.2).abs() < 0.01,
        "{forward_m} {back_m}"
    );
    assert_eq!(world.pose(RobotId(1)).position, Vec2::new(2.698, 3.5));
}

#[test]
fn a_bar_moves_at_most_at_the_push_speed() {
    let mut world = world(&[(2.69, 5.5, 0.0)]);
    drive(&mut world, &[0], 2);
    let from_m = world.pose(RobotId(0)).position.x;
    drive(&mut world, &[0], 20);
    let way_m = world.pose(RobotId(0)).position.x - from_m;
    // The push speed is 0.2 m/s.
    assert!((way_m - 0.2).abs() < 0.005, "{way_m}");
}

#[test]
fn a_bar_moves_only_at_its_outer_thirds_from_behind() {
    let slips = |start: (f32, f32, f32)| {
        let mut world = world(&[start]);
        let events = drive(&mut world, &[0], 30);
        let bar = world.bars()[0];
        assert_eq!((bar.from.x, bar.to.x), (3.0, 3.0), "{start:?}");
        events
    };
    let slipped = |reason: &str| vec![("slipped".to_owned(), reason.to_owned())];
    assert_eq!(slips((2.6, 4.85, 0.0)), slipped("middle"));
    assert_eq!(slips((2.6, 5.2, 35.0)), slipped("angle"));
    // From the front, and beyond the end.
    assert_eq!(slips((3.4, 5.5, 180.0)), []);
    assert_eq!(slips((2.2, 6.05, 0.0)), []);
    for heading in [0.0, 25.0, -25.0] {
        let mut world = world(&[(2.6, 5.3, heading)]);
        drive(&mut world, &[0], 10);
        assert!(world.bars()[0].from.x > 3.01, "{heading}");
    }
}

#[test]
fn a_bar_leans_at_most_by_skew_m() {
    let mut world = world(&[LEFT]);
    let events = drive(&mut world, &[0], 400);
    let bar = world.bars()[0];
    let lead_m = bar.from.x - bar.to.x;
    assert!((0.79..=0.8001).contains(&lead_m), "{lead_m}");
    let expected = [("slipped", "stopped"), ("pushed", "")];
    let expected = expected.map(|(kind, reason)| (kind.to_owned(), reason.to_owned()));
    assert_eq!(events, expected);
}

#[test]
fn bodies_and_obstacles_stop_a_bar() {
    let mut blocked = world(&[LEFT, (3.32, 5.3, 0.0)]);
    drive(&mut blocked, &[0], 100);
    // The way to the body is 0.02 m, and a little more at the end.
    assert!(blocked.bars()[0].from.x < 3.03, "{:?}", blocked.bars()[0]);
    let wall = "[[obstacles]]\nx_m = 3.15\ny_m = 5.0\nwidth_m = 0.2\nheight_m = 0.3\n";
    let mut walled = World::new(&setup(&[LEFT], wall), MISSION.world);
    drive(&mut walled, &[0], 100);
    let bar = walled.bars()[0];
    assert!(bar.from.x > 3.03 && bar.from.x < 3.11, "{bar:?}");
    // The other end moves back only up to a body behind it.
    let mut backed = world(&[LEFT, (2.69, 3.6, 0.0)]);
    drive(&mut backed, &[0], 60);
    assert!(backed.bars()[0].to.x > 2.9, "{:?}", backed.bars()[0]);
}

#[test]
fn a_bar_over_the_line_arrives_once_and_completes_the_mission() {
    let mut setup = setup(&[LEFT, (2.6, 3.5, 0.0)], "");
    let section = setup.scenario.mission.values_mut::<PushSection>().unwrap();
    section.bars[0].goal_x_m = 3.2;
    let mut world = World::new(&setup, MISSION.world);
    let events = drive(&mut world, &[0, 1], 200);
    let arrivals = events.iter().filter(|(kind, _)| kind == "arrived");
    assert_eq!(arrivals.count(), 1);
    assert_eq!(world.mission().end(world.now()), Some(Outcome::Complete));
    let bar = world.bars()[0];
    assert!(bar.from.x >= 3.2 && bar.to.x >= 3.2, "{bar:?}");
}

#[test]
fn a_robot_senses_the_nearer_end_and_the_touch() {
    let mut world = world(&[(2.0, 5.5, 90.0), (0.5, 0.5, 0.0)]);
    let sensed = |world: &World, robot: u32| -> SensorReading {
        let readings = world.readings(RobotId(robot)).mission;
        *readings.value::<SensorReading>()
    };
    let seen = sensed(&world, 0).bar.unwrap().unwrap();
    assert_eq!((seen.bar, seen.end, seen.lead_m), (0, BarEnd::Left, 0.0));
    // The end is 1 m to the right and 0.2 m ahead.
    assert!(
        seen.near_end.distance(Vec2::new(0.2, -1.0)) < 1e-5,
        "{seen:?}"
    );
    assert_eq!(sensed(&world, 0).touch, Some(false));
    assert_eq!(sensed(&world, 1).bar, Some(None));
    world
        .move_robot(RobotId(0), Vec2::new(2.5, 5.5), Some(0.0))
        .unwrap();
    drive(&mut world, &[0], 20);
    assert_eq!(sensed(&world, 0).touch, Some(true));
    let seen = sensed(&world, 0).bar.unwrap().unwrap();
    let bar = world.bars()[0];
    assert!((seen.lead_m - (bar.from.x - bar.to.x)).abs() < 1e-5);
}

#[test]
fn a_robot_cannot_be_moved_onto_a_bar() {
    let mut world = world(&[(2.0, 5.5, 0.0)]);
    let mut moves = |x| {
        world
            .move_robot(RobotId(0), Vec2::new(x, 4.5), None)
            .is_ok()
    };
    assert_eq!([moves(3.1), moves(3.4)], [false, true]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// For any motion of bodies, no two objects overlap, and the bar keeps its length.
    #[test]
    fn nothing_overlaps_for_any_motion_of_bodies(
        starts in prop::collection::vec((0.3..11.7_f32, 0.3..8.7_f32, -180.0..180.0_f32), 1..6),
        turns in prop::collection::vec((-1.6..1.6_f32, 0..4_u8), 120),
        step_ms in prop::sample::select(vec![20_u64, 50, 100, 500]),
    ) {
        let bar = |x: f32, y: f32| (2.6..3.4).contains(&x) && (2.9..6.1).contains(&y);
        let mut apart: Vec<(f32, f32, f32)> = Vec::new();
        for start in starts {
            let is_free = |other: &(f32, f32, f32)| (other.0 - start.0).hypot(other.1 - start.1) > 0.45;
            if !bar(start.0, start.1) && apart.iter().all(is_free) {
                apart.push(start);
            }
        }
        let mut setup = setup(&apart, "");
        setup.scenario.step_ms = step_ms;
        prop_assume!(!apart.is_empty());
        let mut world = World::new(&setup, MISSION.world);
        for (turn_rad_s, steered) in turns {
            let robots = 0..apart.len();
            let commands: Vec<_> = robots.map(|robot| {
                // Most robots head for the bar.
                let to = world.bars()[0].center() - world.pose(RobotId(robot as u32)).position;
                let bearing = to.y.atan2(to.x) - world.pose(RobotId(robot as u32)).heading_rad;
                let turn_rad_s = if robot as u8 % 4 == steered { turn_rad_s } else { bearing };
                Some(Actuation { speed_m_s: 0.5, turn_rad_s, ..Actuation::default() })
            }).collect();
            for _ in 0..5 {
                world.step(&commands);
                if let Err(violation) = world.mission().check_invariants(&world) {
                    prop_assert!(false, "{violation}");
                }
            }
        }
        let bar = world.bars()[0];
        prop_assert!((bar.from.distance(bar.to) - 2.4).abs() < 1e-4);
    }
}
