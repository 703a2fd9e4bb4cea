//! Turning, moving, and stopping before solids.

use std::f32::consts::PI;

use super::*;

const AHEAD: f32 = 0.5;

#[test]
fn turns_first_and_then_moves_within_the_limits() {
    let long_steps = |start| {
        world(|scenario| {
            robots(&[start])(scenario);
            scenario.step_ms = 500;
        })
    };
    let mut world = long_steps((6.0, 4.5, 0.0));
    // The limits are 90 degrees and 0.5 m per second.
    world.step(&[drive(2.0, 1000.0)]);
    let diagonal = 0.25 / 2.0_f32.sqrt();
    assert_near(world.pose(BLUE).heading_rad, PI / 4.0);
    assert_at(position(&world, BLUE), 6.0 + diagonal, 4.5 + diagonal);
    assert_near(world.speed_m_s(BLUE), 0.5);
    assert_eq!(world.now().0, 500);
    // Headings stay in range.
    let mut world = long_steps((6.0, 4.5, 180.0));
    assert_eq!(world.pose(BLUE).heading_rad, PI);
    world.step(&[drive(0.0, 90.0)]);
    assert_near(world.pose(BLUE).heading_rad, -0.75 * PI);
    world.step(&[drive(0.0, -90.0)]);
    assert_near(world.pose(BLUE).heading_rad.abs(), PI);
    world.step(&[drive(0.0, -90.0)]);
    assert_near(world.pose(BLUE).heading_rad, 0.75 * PI);
}

#[test]
fn a_command_with_an_invalid_speed_does_not_move_the_body() {
    let mut world = room(&[(6.0, 4.5, 30.0)], &[]);
    let before = world.pose(BLUE);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        world.step(&[drive(value, value)]);
    }
    for commands in [&[drive(-0.5, 0.0)][..], &[None], &[]] {
        world.step(commands);
    }
    assert_eq!((world.pose(BLUE), world.speed_m_s(BLUE)), (before, 0.0));
}

#[test]
fn stops_a_skin_short_of_border_obstacle_and_robot() {
    let upward = (5.0, 4.0, 90.0);
    let starts = [(11.5, 1.0, 0.0), upward, (5.0, 8.0, 180.0), (4.0, 8.0, 0.0)];
    let mut world = room(&starts, &[rectangle(4.0, 5.0, 2.0, 1.0, 0.1)]);
    let ahead = drive(AHEAD, 0.0);
    run(&mut world, 100, &[ahead, ahead, ahead, None]);
    assert_at(position(&world, BLUE), 12.0 - 0.2 - SKIN_M, 1.0);
    assert_at(position(&world, GOLD), 5.0, 5.0 - 0.2 - SKIN_M);
    assert_at(position(&world, RobotId(2)), 4.4 + SKIN_M, 8.0);
    assert_near(world.speed_m_s(BLUE), 0.0);
}

/// The corner is 0.1 m left of the center's line, so contact is sqrt(0.2² - 0.1²) before it. A disc 0.21 m beside the
/// corner passes.
#[test]
fn meets_the_corner_of_an_obstacle_with_the_side_of_its_disc() {
    let reach = 0.2 + SKIN_M;
    for (y, x) in [(1.9, 3.0 - (reach * reach - 0.01).sqrt()), (1.79, 4.5)] {
        let mut world = room(&[(2.0, y, 0.0)], &[solid(3.0, 2.0, 1.0, 1.0)]);
        run(&mut world, 100, &[drive(AHEAD, 0.0)]);
        assert_at(position(&world, BLUE), x, y);
    }
}

/// The robot heads against the left wall, then turns right by 90 degrees. Rounding must not pin the robot to the wall.
#[test]
fn follows_a_wall_after_running_into_it() {
    let mut world = room(&[(1.0, 1.0, 180.0)], &[]);
    run(&mut world, 40, &[drive(AHEAD, 0.0)]);
    run(&mut world, 20, &[drive(0.0, -90.0)]);
    run(&mut world, 200, &[drive(AHEAD, 0.0)]);
    let position = position(&world, BLUE);
    assert!(position.y > 5.99, "{position}");
    assert!(position.x >= 0.2 + SKIN_M / 2.0 - 1e-5, "{position}");
}

#[test]
fn a_robot_under_a_new_obstacle_can_only_leave_it() {
    let mut world = room(&[(3.0, 4.5, 0.0)], &[]);
    world.add_obstacle(&solid(2.9, 3.0, 5.0, 3.0));
    world.step(&[drive(AHEAD, 0.0)]);
    assert_at(position(&world, BLUE), 3.0, 4.5);
    run(&mut world, 40, &[drive(0.0, 90.0)]);
    run(&mut world, 20, &[drive(AHEAD, 0.0)]);
    assert_at(position(&world, BLUE), 2.5, 4.5);
}

#[test]
fn robots_that_are_not_solid_pass_through_each_other() {
    let mut world = world(|scenario| {
        robots(&[(3.0, 4.5, 0.0), (4.0, 4.5, 0.0)])(scenario);
        scenario.body.robot_penetrability = 1.0;
    });
    run(&mut world, 80, &[drive(AHEAD, 0.0), None]);
    assert_at(position(&world, BLUE), 5.0, 4.5);
}

/// A follower of lower rank moves first and meets the leader at its old place. Otherwise both move together.
#[test]
fn robots_move_in_rank_order() {
    let gap = 2.0 * 0.2 + SKIN_M;
    let (behind, before) = ((3.0, 4.5, 0.0), (3.0 + gap, 4.5, 0.0));
    for (starts, way_m) in [
        ([behind, before], [0.0, 0.025]),
        ([before, behind], [0.025; 2]),
    ] {
        let mut world = room(&starts, &[]);
        world.step(&[drive(AHEAD, 0.0), drive(AHEAD, 0.0)]);
        for (robot, (start, way_m)) in [BLUE, GOLD].into_iter().zip(starts.iter().zip(way_m)) {
            assert_at(position(&world, robot), start.0 + way_m, 4.5);
        }
    }
}
