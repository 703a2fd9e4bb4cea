//! Energy, and the order of the aspects within a step.

use crate::waste::data::WasteSection;
use proto::mission::items::ItemsAction;
use scenario::Energy;

use super::*;
use run_log::recorder::{Event, EventKind};

fn battery(capacity_j: f32) -> impl FnOnce(&mut Scenario) {
    move |scenario| {
        robots(&[(6.0, 4.5, 0.0)])(scenario);
        scenario.step_ms = 100;
        scenario.energy = Some(Energy {
            capacity_j,
            idle_w: 5.0,
            drive_w: 20.0,
        });
    }
}

#[test]
fn idling_and_driving_draw_on_the_battery() {
    let mut world = world(battery(100.0));
    assert_eq!(world.readings(BLUE).energy_j, Some(100.0));
    world.step(&[None]);
    assert_near(world.energy_j(BLUE).expect("simulated"), 99.5);
    world.step(&[drive(0.5, 0.0)]);
    assert_near(world.energy_j(BLUE).expect("simulated"), 97.0);
    world.step(&[drive(0.25, 0.0)]);
    assert_near(world.energy_j(BLUE).expect("simulated"), 95.5);
}

#[test]
fn a_long_mission_of_short_steps_loses_nothing_to_rounding() {
    let mut world = world(|scenario| {
        battery(50_000.0)(scenario);
        scenario.step_ms = 1;
    });
    for _ in 0..100_000 {
        world.step(&[None]);
    }
    assert_near(world.energy_j(BLUE).expect("simulated"), 49_500.0);
}

#[test]
fn a_robot_without_energy_does_nothing_and_logs_it_once() {
    let mut world = world(|scenario| {
        battery(1.2)(scenario);
        WasteSection::of_mut(scenario).spills[0].items = 1;
        WasteSection::of_mut(scenario).spills[0].x_fraction = 0.5;
        WasteSection::of_mut(scenario).spills[0].y_fraction = 0.5;
        WasteSection::of_mut(scenario).spill_radius_m = 0.1;
    });
    let command = Actuation {
        speed_m_s: 0.05,
        turn_rad_s: 1.0,
        action: ItemsAction {
            gripper: Gripper::Pick,
            report: true,
        }
        .into(),
    };
    let mut out = Vec::new();
    for _ in 0..10 {
        let events = world.step(&[Some(command)]);
        out.extend(
            events
                .into_iter()
                .filter(|event| event.kind == EventKind::EnergyOut),
        );
    }
    assert_eq!(out, [Event::new(EventKind::EnergyOut, Some(BLUE))]);
    assert_eq!(world.energy_j(BLUE), Some(0.0));
    let before = world.pose(BLUE);
    let events = world.step(&[Some(Actuation {
        action: Gripper::Drop.into(),
        ..command
    })]);
    assert_eq!((events, world.pose(BLUE)), (Vec::new(), before));
    assert_eq!(world.speed_m_s(BLUE), 0.0);
    // The robot still holds its load. Another cause may make it drop the load.
    assert!(world.carrying(BLUE).is_some());
    assert!(!world.release_load(BLUE).is_empty());
}
