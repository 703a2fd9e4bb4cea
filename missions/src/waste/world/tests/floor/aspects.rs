//! Energy, and the order of the aspects within a step.

use run_log::recorder::{Event, EventKind};
use scenario::Energy;

use super::*;

fn battery(capacity_j: f32, step_ms: u64) -> impl FnOnce(&mut Scenario) {
    move |scenario| {
        robots(&[(6.0, 4.5, 0.0)])(scenario);
        scenario.step_ms = step_ms;
        scenario.energy = Some(Energy {
            capacity_j,
            ..Energy::default()
        });
    }
}

#[test]
fn idling_and_driving_draw_on_the_battery() {
    let mut world = world(battery(100.0, 100));
    assert_eq!(world.readings(BLUE).energy_j, Some(100.0));
    for (command, left_j) in [
        (None, 99.5),
        (drive(0.5, 0.0), 97.0),
        (drive(0.25, 0.0), 95.5),
    ] {
        world.step(&[command]);
        assert_near(world.energy_j(BLUE).unwrap(), left_j);
    }
}

#[test]
fn a_long_mission_of_short_steps_loses_nothing_to_rounding() {
    let mut world = world(battery(50_000.0, 1));
    run(&mut world, 100_000, &[None]);
    assert_near(world.energy_j(BLUE).unwrap(), 49_500.0);
}

#[test]
fn a_robot_without_energy_does_nothing_and_logs_it_once() {
    let mut world = world(|scenario| {
        battery(1.2, 100)(scenario);
        spill(scenario, (6.0, 4.5), 1, 0.1);
    });
    let moves = |gripper| {
        Some(Actuation {
            speed_m_s: 0.05,
            turn_rad_s: 1.0,
            action: ItemsAction { gripper, ..REPORT }.into(),
        })
    };
    let mut events = Vec::new();
    for _ in 0..10 {
        events.extend(world.step(&[moves(Gripper::Pick)]));
    }
    events.retain(|event| event.kind == EventKind::EnergyOut);
    assert_eq!(events, [Event::new(EventKind::EnergyOut, Some(BLUE))]);
    assert_eq!(world.energy_j(BLUE), Some(0.0));
    let before = world.pose(BLUE);
    assert_eq!(world.step(&[moves(Gripper::Drop)]), []);
    assert_eq!((world.pose(BLUE), world.speed_m_s(BLUE)), (before, 0.0));
    // The robot still holds its load. Another cause may make it drop the load.
    assert!(world.carrying(BLUE).is_some());
    assert!(!world.release_load(BLUE).is_empty());
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
