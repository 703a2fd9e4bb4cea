//! Penetrability: all four kinds, with exact speeds (thesis §3.2.2.1).

use super::*;

/// Returns x after a number of steps of 500 ms, for a robot that heads along x from (1, 4.5) at 0.5 m/s.
fn x_after(steps: usize, obstacles: Vec<Obstacle>) -> f32 {
    let mut world = world(|scenario| {
        robots(&[(1.0, 4.5, 0.0)])(scenario);
        scenario.step_ms = 500;
        scenario.obstacles = obstacles;
    });
    for _ in 0..steps {
        world.step(&[drive(0.5, 0.0)]);
    }
    position(&world, BLUE).x
}

#[test]
fn the_four_kinds() {
    let patch = |penetrability| vec![rectangle(0.5, 4.0, 8.0, 1.0, penetrability)];
    assert_near(x_after(2, Vec::new()), 1.5);
    assert_near(x_after(2, patch(1.0)), 1.5);
    assert_near(x_after(2, patch(0.5)), 1.25);
    assert_near(x_after(2, patch(0.11)), 1.055);
    assert_near(x_after(2, patch(3.0)), 2.5);
    for solid in [0.0, 0.05, 0.1] {
        let wall = vec![rectangle(1.4, 4.0, 8.0, 1.0, solid)];
        assert_near(x_after(2, wall), 1.199);
    }
}

#[test]
fn a_long_step_is_slowed_only_on_the_patch() {
    // 0.1 m at 0.5 m/s, 0.05 m at 0.25 m/s, and the last 0.1 s at 0.5 m/s again.
    let narrow = rectangle(1.1, 4.0, 0.05, 1.0, 0.5);
    assert_near(x_after(1, vec![narrow]), 1.2);
    // 0.1 m at 0.5 m/s, then 0.3 s at 0.25 m/s.
    let wide = rectangle(1.1, 4.0, 1.0, 1.0, 0.5);
    assert_near(x_after(1, vec![wide]), 1.175);
    // 0.1 m at 0.5 m/s, then 0.3 m at 2 m/s, then 0.15 s at 0.5 m/s.
    let fast = rectangle(1.1, 4.0, 0.3, 1.0, 4.0);
    assert_near(x_after(1, vec![fast]), 1.475);
}

#[test]
fn where_patches_overlap_the_slowest_decides() {
    let patch = |penetrability| rectangle(0.5, 4.0, 8.0, 1.0, penetrability);
    assert_near(x_after(2, vec![patch(0.5), patch(0.8), patch(3.0)]), 1.25);
    assert_near(x_after(2, vec![patch(3.0), patch(2.0)]), 2.0);
    // Neutral ground has no effect, not even on ground below it.
    assert_near(x_after(2, vec![patch(3.0), patch(1.0)]), 2.5);
}

#[test]
fn a_patch_acts_at_the_center_of_the_body_only() {
    assert_near(x_after(2, vec![rectangle(0.5, 4.55, 8.0, 1.0, 0.5)]), 1.5);
}

#[test]
fn a_solid_stops_also_on_a_fast_patch() {
    let fast = rectangle(0.5, 4.0, 8.0, 1.0, 100.0);
    let wall = rectangle(4.0, 4.0, 0.01, 1.0, 0.0);
    assert_near(x_after(3, vec![fast, wall]), 3.799);
}

#[test]
fn a_robot_that_is_not_solid_is_ground_to_others() {
    let mut world = world(|scenario| {
        robots(&[(3.0, 4.5, 0.0), (3.0, 4.5, 0.0), (9.0, 4.5, 0.0)])(scenario);
        scenario.body.robot_penetrability = 0.5;
        scenario.step_ms = 100;
    });
    assert_eq!(
        world.readings(BLUE).ground.map(|ground| ground.here),
        Some(0.5)
    );
    world.step(&[drive(0.5, 0.0), None, drive(0.5, 0.0)]);
    assert_at(position(&world, BLUE), 3.025, 4.5);
    assert_at(position(&world, RobotId(2)), 9.05, 4.5);
}

#[test]
fn the_ground_sensor_reads_here_and_one_radius_beyond_the_front() {
    let world = world(|scenario| {
        robots(&[(3.0, 4.5, 0.0), (11.7, 4.5, 0.0)])(scenario);
        scenario.obstacles = vec![
            rectangle(2.9, 4.0, 0.2, 1.0, 0.5),
            rectangle(3.35, 4.0, 0.1, 1.0, 0.0),
        ];
    });
    let ground = |robot| {
        let ground = world
            .readings(robot)
            .ground
            .expect("every robot has the sensor");
        (ground.here, ground.ahead)
    };
    assert_eq!(ground(BLUE), (0.5, 0.0));
    // The front point lies beyond the border.
    assert_eq!(ground(GOLD), (1.0, 0.0));
}
