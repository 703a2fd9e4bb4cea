//! Bars that bodies drive against, by commands and by a physics that shares nothing with ours.

use alliance_proto::readings::Actuation;
use alliance_proto::scenario::{Scenario, Setup};
use proptest::prelude::*;
use world_server::recorder::EventKind;
use world_server::world::World;

use super::*;
use crate::Registry;

/// A bar at x = 3 in a room of 12 × 9 m, and robots with those starts: x, y and heading in degrees.
fn setup(starts: &[(f32, f32, f32)], more: &str) -> Setup {
    let mut text =
        format!("step_ms = 50\n{more}\n[push]\n[[push.bars]]\nx_m = 3\ny_m = 4.5\ngoal_x_m = 9\n");
    for (index, (x, y, heading)) in starts.iter().enumerate() {
        text += &format!(
            "[[robots]]\nname = 'r{index}'\nstart = {{ x_m = {x}, y_m = {y}, heading_deg = {heading} }}\n"
        );
    }
    let scenario = match Scenario::parse("s.toml", &text, &Registry::built_in().vocabulary()) {
        Ok(scenario) => scenario,
        Err(error) => panic!("{error}"),
    };
    Setup::resolve(scenario, 1, None).unwrap().setup
}

fn world(starts: &[(f32, f32, f32)]) -> World {
    World::new(&setup(starts, ""), super::super::PARTS.world)
}

/// Those robots drive straight ahead, the others stand still; what happens in so many steps.
fn drive(world: &mut World, robots: &[usize], steps: usize) -> Vec<(String, String)> {
    let mut told = Vec::new();
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
                told.push((kind.to_owned(), event.reason));
            }
        }
        world.mission().holds(world).unwrap();
    }
    told
}

/// Where a push far from the middle turns a rod: by hand, from the torque and the force of friction on many pieces of the rod.
/// The rod turns about the point for which the push does the least work against friction.
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
        let ours = turns_about(along_m, 2.4);
        let expected = by_least_work(along_m.into(), 2.4);
        assert!(
            (f64::from(ours) - expected).abs() < 0.005,
            "{along_m}: {ours} {expected}"
        );
        assert_eq!(turns_about(-along_m, 2.4), -ours);
    }
    // Published: pushed at its end, L/√2 from there; so the other end goes back by √2 - 1.
    let from_end_m = 1.2 - turns_about(1.2, 2.4);
    assert!((from_end_m - 2.4 / std::f32::consts::SQRT_2).abs() < 1e-5);
    let back = (2.4 - from_end_m) / from_end_m;
    assert!((back - (std::f32::consts::SQRT_2 - 1.0)).abs() < 1e-5);
}

/// The world's bar, from its ends alone: where it crosses itself as it was is the point about which it has turned.
#[test]
fn a_bar_that_nobody_holds_turns_about_that_point() {
    let mut world = world(&[(2.6, 5.6, 0.0)]);
    drive(&mut world, &[0], 6);
    let before = world.bars()[0];
    drive(&mut world, &[0], 10);
    let after = world.bars()[0];
    assert!(after.from.x > before.from.x && after.to.x < before.to.x);
    let share =
        (after.from.x - before.from.x) / (after.from.x - before.from.x + before.to.x - after.to.x);
    let from_end_m = 2.4 * share;
    // It pushes 0.1 m from the end, as the pivot of least work has it.
    let expected = 1.2 - by_least_work(1.1, 2.4) as f32;
    assert!(
        (from_end_m - expected).abs() < 0.02,
        "{from_end_m} {expected}"
    );
}

/// Who stands behind the other end holds it.
#[test]
fn a_body_holds_the_other_end() {
    let mut world = world(&[(2.6, 5.5, 0.0), (2.698, 3.5, 0.0)]);
    drive(&mut world, &[0], 12);
    let bar = world.bars()[0];
    // It turns about the place where it is held, 0.2 m from its end.
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
fn it_gives_way_no_faster_than_a_body_pushes() {
    let mut world = world(&[(2.69, 5.5, 0.0)]);
    drive(&mut world, &[0], 2);
    let from_m = world.pose(RobotId(0)).position.x;
    drive(&mut world, &[0], 20);
    let way_m = world.pose(RobotId(0)).position.x - from_m;
    // 0.2 m/s.
    assert!((way_m - 0.2).abs() < 0.005, "{way_m}");
}

#[test]
fn it_gives_way_at_its_outer_thirds_from_behind_and_straight_alone() {
    let slips = |start: (f32, f32, f32)| {
        let mut world = world(&[start]);
        let told = drive(&mut world, &[0], 30);
        let bar = world.bars()[0];
        assert_eq!((bar.from.x, bar.to.x), (3.0, 3.0), "{start:?}");
        told
    };
    let slipped = |why: &str| vec![("slipped".to_owned(), why.to_owned())];
    assert_eq!(slips((2.6, 4.85, 0.0)), slipped("middle"));
    assert_eq!(slips((2.6, 5.2, 35.0)), slipped("angle"));
    // From the front, and past its end.
    assert_eq!(slips((3.4, 5.5, 180.0)), []);
    assert_eq!(slips((2.2, 6.05, 0.0)), []);
    for heading in [0.0, 25.0, -25.0] {
        let mut world = world(&[(2.6, 5.3, heading)]);
        drive(&mut world, &[0], 10);
        assert!(world.bars()[0].from.x > 3.01, "{heading}");
    }
}

#[test]
fn it_stands_no_more_askew_than_it_may() {
    let mut world = world(&[(2.6, 5.5, 0.0)]);
    let told = drive(&mut world, &[0], 400);
    let bar = world.bars()[0];
    let lead_m = bar.from.x - bar.to.x;
    assert!((0.79..=0.8001).contains(&lead_m), "{lead_m}");
    assert_eq!(
        told,
        [
            ("slipped".to_owned(), "stopped".to_owned()),
            ("pushed".to_owned(), String::new())
        ]
    );
}

#[test]
fn bodies_and_obstacles_in_its_way_stop_it() {
    let mut blocked = world(&[(2.6, 5.5, 0.0), (3.32, 5.3, 0.0)]);
    drive(&mut blocked, &[0], 100);
    // 0.02 m up to the body, and a little more at the end.
    assert!(blocked.bars()[0].from.x < 3.03, "{:?}", blocked.bars()[0]);
    let wall = "[[obstacles]]\nx_m = 3.15\ny_m = 5.0\nwidth_m = 0.2\nheight_m = 0.3\n";
    let mut walled = World::new(&setup(&[(2.6, 5.5, 0.0)], wall), super::super::PARTS.world);
    drive(&mut walled, &[0], 100);
    let bar = walled.bars()[0];
    assert!(bar.from.x > 3.03 && bar.from.x < 3.11, "{bar:?}");
    // And it goes back no farther than to a body behind it.
    let mut backed = world(&[(2.6, 5.5, 0.0), (2.69, 3.6, 0.0)]);
    drive(&mut backed, &[0], 60);
    assert!(backed.bars()[0].to.x > 2.9, "{:?}", backed.bars()[0]);
}

#[test]
fn a_bar_over_the_line_has_arrived_once_and_the_mission_is_complete() {
    let mut setup = setup(&[(2.6, 5.5, 0.0), (2.6, 3.5, 0.0)], "");
    let section = setup.scenario.mission.values_mut::<PushSection>().unwrap();
    section.bars[0].goal_x_m = 3.2;
    let mut world = World::new(&setup, super::super::PARTS.world);
    let told = drive(&mut world, &[0, 1], 200);
    assert_eq!(told.iter().filter(|(kind, _)| kind == "arrived").count(), 1);
    assert_eq!(world.mission().end(world.now()), Some(Outcome::Complete));
    let bar = world.bars()[0];
    assert!(bar.from.x >= 3.2 && bar.to.x >= 3.2, "{bar:?}");
}

#[test]
fn a_robot_sees_the_nearer_end_and_feels_the_bar() {
    let mut world = world(&[(2.0, 5.5, 90.0), (0.5, 0.5, 0.0)]);
    let sensed = |world: &World, robot: u16| -> Sensed {
        match world.readings(RobotId(robot)).mission {
            alliance_proto::mission::Sensed::Open(bytes) => bytes.decode().unwrap(),
            _ => panic!("something is sensed"),
        }
    };
    let seen = sensed(&world, 0).bar.unwrap().unwrap();
    assert_eq!((seen.bar, seen.end, seen.lead_m), (0, End::Left, 0.0));
    // A meter to the right, 0.2 m ahead.
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
fn nobody_is_put_on_a_bar() {
    let mut world = world(&[(2.0, 5.5, 0.0)]);
    assert!(
        world
            .move_robot(RobotId(0), Vec2::new(3.1, 4.5), None)
            .is_err()
    );
    assert!(
        world
            .move_robot(RobotId(0), Vec2::new(3.4, 4.5), None)
            .is_ok()
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever bodies do, and whichever way they turn, no two things overlap, and the bar is as long as it was.
    #[test]
    fn nothing_overlaps_whatever_bodies_do(
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
        let mut world = World::new(&setup, super::super::PARTS.world);
        for (turn_rad_s, who) in turns {
            let robots = 0..apart.len();
            let commands: Vec<_> = robots.map(|robot| {
                // Most head for the bar.
                let to = world.bars()[0].center() - world.pose(RobotId(robot as u16)).position;
                let bearing = to.y.atan2(to.x) - world.pose(RobotId(robot as u16)).heading_rad;
                let turn_rad_s = if robot as u8 % 4 == who { turn_rad_s } else { bearing };
                Some(Actuation { speed_m_s: 0.5, turn_rad_s, ..Actuation::default() })
            }).collect();
            for _ in 0..5 {
                world.step(&commands);
                if let Err(violation) = world.mission().holds(&world) {
                    prop_assert!(false, "{violation}");
                }
            }
        }
        let bar = world.bars()[0];
        prop_assert!((bar.from.distance(bar.to) - 2.4).abs() < 1e-4);
    }
}
