//! Turning, moving, and stopping before solids.

use std::f32::consts::PI;

use super::*;
use world_server::world::SKIN_M;

#[test]
fn turns_first_and_then_moves_within_the_limits() {
    let mut world = world(|scenario| {
        robots(&[(6.0, 4.5, 0.0)])(scenario);
        scenario.step_ms = 500;
    });
    // The limits are 90 degrees and 0.5 m per second.
    world.step(&[drive(2.0, 1000.0)]);
    let diagonal = 0.25 / 2.0_f32.sqrt();
    assert_near(world.pose(BLUE).heading_rad, PI / 4.0);
    assert_at(position(&world, BLUE), 6.0 + diagonal, 4.5 + diagonal);
    assert_near(world.speed_m_s(BLUE), 0.5);
    assert_eq!(world.now().0, 500);
}

#[test]
fn headings_stay_in_range() {
    let mut world = world(|scenario| {
        robots(&[(6.0, 4.5, 180.0)])(scenario);
        scenario.step_ms = 500;
    });
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
    let mut world = world(robots(&[(6.0, 4.5, 30.0)]));
    let before = world.pose(BLUE);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        world.step(&[drive(value, value)]);
    }
    world.step(&[drive(-0.5, 0.0)]);
    world.step(&[None]);
    world.step(&[]);
    assert_eq!(world.pose(BLUE), before);
    assert_eq!(world.speed_m_s(BLUE), 0.0);
}

#[test]
fn stops_a_skin_short_of_border_obstacle_and_robot() {
    let mut world = world(|scenario| {
        robots(&[
            (11.5, 1.0, 0.0),
            (5.0, 4.0, 90.0),
            (5.0, 8.0, 180.0),
            (4.0, 8.0, 0.0),
        ])(scenario);
        scenario.obstacles = vec![rectangle(4.0, 5.0, 2.0, 1.0, 0.1)];
    });
    for _ in 0..100 {
        world.step(&[drive(0.5, 0.0), drive(0.5, 0.0), drive(0.5, 0.0), None]);
    }
    assert_at(position(&world, BLUE), 12.0 - 0.2 - SKIN_M, 1.0);
    assert_at(position(&world, GOLD), 5.0, 5.0 - 0.2 - SKIN_M);
    assert_at(position(&world, RobotId(2)), 4.4 + SKIN_M, 8.0);
    assert_near(world.speed_m_s(BLUE), 0.0);
}

#[test]
fn meets_the_corner_of_an_obstacle_with_the_side_of_its_disc() {
    // The corner is 0.1 m left of the center's line, so contact is sqrt(0.2² - 0.1²) before it.
    let mut world = world(|scenario| {
        robots(&[(2.0, 1.9, 0.0)])(scenario);
        scenario.obstacles = vec![rectangle(3.0, 2.0, 1.0, 1.0, 0.0)];
    });
    for _ in 0..100 {
        world.step(&[drive(0.5, 0.0)]);
    }
    let reach = 0.2 + SKIN_M;
    assert_at(
        position(&world, BLUE),
        3.0 - (reach * reach - 0.01).sqrt(),
        1.9,
    );
}

#[test]
fn passes_a_corner_that_it_does_not_touch() {
    let mut world = world(|scenario| {
        robots(&[(2.0, 1.79, 0.0)])(scenario);
        scenario.obstacles = vec![rectangle(3.0, 2.0, 1.0, 1.0, 0.0)];
    });
    for _ in 0..100 {
        world.step(&[drive(0.5, 0.0)]);
    }
    assert_at(position(&world, BLUE), 4.5, 1.79);
}

#[test]
fn follows_a_wall_after_running_into_it() {
    // The robot heads against the left wall, then turns right by 90 degrees. Rounding must not pin the robot to the
    // wall.
    let mut world = world(robots(&[(1.0, 1.0, 180.0)]));
    for _ in 0..40 {
        world.step(&[drive(0.5, 0.0)]);
    }
    for _ in 0..20 {
        world.step(&[drive(0.0, -90.0)]);
    }
    for _ in 0..200 {
        world.step(&[drive(0.5, 0.0)]);
    }
    let position = position(&world, BLUE);
    assert!(position.y > 5.99, "{position}");
    assert!(position.x >= 0.2 + SKIN_M / 2.0 - 1e-5, "{position}");
}

#[test]
fn a_robot_under_a_new_obstacle_can_only_leave_it() {
    let mut world = world(robots(&[(3.0, 4.5, 0.0)]));
    world.add_obstacle(&rectangle(2.9, 3.0, 5.0, 3.0, 0.0));
    world.step(&[drive(0.5, 0.0)]);
    assert_at(position(&world, BLUE), 3.0, 4.5);
    for _ in 0..40 {
        world.step(&[drive(0.0, 90.0)]);
    }
    for _ in 0..20 {
        world.step(&[drive(0.5, 0.0)]);
    }
    assert_at(position(&world, BLUE), 2.5, 4.5);
}

#[test]
fn robots_that_are_not_solid_pass_through_each_other() {
    let mut world = world(|scenario| {
        robots(&[(3.0, 4.5, 0.0), (4.0, 4.5, 0.0)])(scenario);
        scenario.body.robot_penetrability = 1.0;
    });
    for _ in 0..80 {
        world.step(&[drive(0.5, 0.0), None]);
    }
    assert_at(position(&world, BLUE), 5.0, 4.5);
}

#[test]
fn robots_move_in_rank_order() {
    // A follower of lower rank moves first and meets the leader at its old place. Otherwise both move together.
    for (follower, leader, expected) in [(0, 1, 0.0), (1, 0, 0.025)] {
        let gap = 2.0 * 0.2 + SKIN_M;
        let mut starts = [(0.0, 0.0, 0.0); 2];
        starts[follower] = (3.0, 4.5, 0.0);
        starts[leader] = (3.0 + gap, 4.5, 0.0);
        let mut world = world(robots(&starts));
        world.step(&[drive(0.5, 0.0), drive(0.5, 0.0)]);
        assert_at(
            position(&world, RobotId(follower as u16)),
            3.0 + expected,
            4.5,
        );
        assert_at(position(&world, RobotId(leader as u16)), 3.025 + gap, 4.5);
    }
}
