//! Penetrability: all four kinds, with exact speeds (thesis §3.2.2.1).

use super::*;

/// Checks x after a number of steps of 500 ms, for a robot that heads along x from (1, 4.5) at 0.5 m/s.
#[track_caller]
fn assert_x_after(steps: usize, obstacles: &[Obstacle], expected: f32) {
    let mut world = world(|scenario| {
        robots(&[(1.0, 4.5, 0.0)])(scenario);
        scenario.step_ms = 500;
        scenario.obstacles = obstacles.to_vec();
    });
    run(&mut world, steps, &[drive(0.5, 0.0)]);
    assert_near(position(&world, BLUE).x, expected);
}

/// Returns ground around the robot's whole way.
fn patch(penetrability: f32) -> Obstacle {
    rectangle(0.5, 4.0, 8.0, 1.0, penetrability)
}

#[test]
fn ground_slows_down_speeds_up_or_stops() {
    assert_x_after(2, &[], 1.5);
    for (penetrability, x) in [(1.0, 1.5), (0.5, 1.25), (0.11, 1.055), (3.0, 2.5)] {
        assert_x_after(2, &[patch(penetrability)], x);
    }
    for solid in [0.0, 0.05, 0.1] {
        assert_x_after(2, &[rectangle(1.4, 4.0, 8.0, 1.0, solid)], 1.199);
    }
    // A patch acts at the center of the body only.
    assert_x_after(2, &[rectangle(0.5, 4.55, 8.0, 1.0, 0.5)], 1.5);
    // A solid also stops a robot on a fast patch.
    assert_x_after(3, &[patch(100.0), solid(4.0, 4.0, 0.01, 1.0)], 3.799);
}

#[test]
fn a_long_step_is_slowed_only_on_the_patch() {
    let ground = |width_m, penetrability| rectangle(1.1, 4.0, width_m, 1.0, penetrability);
    // 0.1 m at 0.5 m/s, 0.05 m at 0.25 m/s, and the last 0.1 s at 0.5 m/s again.
    assert_x_after(1, &[ground(0.05, 0.5)], 1.2);
    // 0.1 m at 0.5 m/s, then 0.3 s at 0.25 m/s.
    assert_x_after(1, &[ground(1.0, 0.5)], 1.175);
    // 0.1 m at 0.5 m/s, then 0.3 m at 2 m/s, then 0.15 s at 0.5 m/s.
    assert_x_after(1, &[ground(0.3, 4.0)], 1.475);
}

#[test]
fn where_patches_overlap_the_slowest_decides() {
    assert_x_after(2, &[patch(0.5), patch(0.8), patch(3.0)], 1.25);
    assert_x_after(2, &[patch(3.0), patch(2.0)], 2.0);
    // Neutral ground has no effect, not even on ground below it.
    assert_x_after(2, &[patch(3.0), patch(1.0)], 2.5);
}

#[test]
fn a_robot_that_is_not_solid_is_ground_to_others() {
    let mut world = world(|scenario| {
        robots(&[(3.0, 4.5, 0.0), (3.0, 4.5, 0.0), (9.0, 4.5, 0.0)])(scenario);
        scenario.body.robot_penetrability = 0.5;
        scenario.step_ms = 100;
    });
    assert_eq!(world.readings(BLUE).ground.unwrap().here, 0.5);
    world.step(&[drive(0.5, 0.0), None, drive(0.5, 0.0)]);
    assert_at(position(&world, BLUE), 3.025, 4.5);
    assert_at(position(&world, RobotId(2)), 9.05, 4.5);
}

#[test]
fn the_ground_sensor_reads_here_and_one_radius_beyond_the_front() {
    let soft = rectangle(2.9, 4.0, 0.2, 1.0, 0.5);
    let starts = [(3.0, 4.5, 0.0), (11.7, 4.5, 0.0)];
    let world = room(&starts, &[soft, solid(3.35, 4.0, 0.1, 1.0)]);
    // Gold's front point lies beyond the border.
    for (robot, expected) in [(BLUE, (0.5, 0.0)), (GOLD, (1.0, 0.0))] {
        let ground = world.readings(robot).ground.unwrap();
        assert_eq!((ground.here, ground.ahead), expected);
    }
}
