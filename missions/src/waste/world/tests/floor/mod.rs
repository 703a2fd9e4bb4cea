//! Invariants of the world as a whole.

mod aspects;
mod change;
mod ground;
mod motion;
mod random;
mod sensing;
mod start;

use crate::waste::data::{WasteSection, default_setup};
use glam::Vec2;
use proto::mission::items::Gripper;
use proto::readings::Actuation;
use scenario::ids::RobotId;
use scenario::{Obstacle, Robot, Scenario, Setup, Start};

use super::CleanUp;
use crate::waste::MISSION;
use world_server::world::World;

pub(crate) const BLUE: RobotId = RobotId(0);
pub(crate) const GOLD: RobotId = RobotId(1);

/// Creates the default world after changes to the scenario.
pub(crate) fn world(change: impl FnOnce(&mut Scenario)) -> World {
    let mut setup = default_setup(1);
    change(&mut setup.scenario);
    World::new(&setup, MISSION.world)
}

/// Places robots at (x, y, heading in degrees) in a room without items. The first has a side sensor.
pub(crate) fn robots(starts: &[(f32, f32, f32)]) -> impl FnOnce(&mut Scenario) {
    let team = starts
        .iter()
        .enumerate()
        .map(|(rank, &(x_m, y_m, heading_deg))| Robot {
            name: format!("r{rank}"),
            side_sensor: rank == 0,
            absent: false,
            start: Some(Start {
                x_m,
                y_m,
                heading_deg,
            }),
            ..Robot::default()
        });
    let team = team.collect();
    |scenario| {
        scenario.robots = team;
        for spill in &mut WasteSection::of_mut(scenario).spills {
            spill.items = 0;
        }
    }
}

pub(crate) fn rectangle(
    x_m: f32,
    y_m: f32,
    width_m: f32,
    height_m: f32,
    penetrability: f32,
) -> Obstacle {
    Obstacle {
        x_m,
        y_m,
        width_m,
        height_m,
        penetrability,
    }
}

pub(crate) fn drive(speed_m_s: f32, turn_deg_s: f32) -> Option<Actuation> {
    Some(Actuation {
        speed_m_s,
        turn_rad_s: turn_deg_s.to_radians(),
        ..Actuation::default()
    })
}

pub(crate) fn gripper(gripper: Gripper) -> Option<Actuation> {
    Some(Actuation {
        action: gripper.into(),
        ..Actuation::default()
    })
}

pub(crate) fn position(world: &World, robot: RobotId) -> Vec2 {
    world.pose(robot).position
}

#[track_caller]
pub(crate) fn assert_near(actual: f32, expected: f32) {
    assert!(
        (actual - expected).abs() < 2e-5,
        "{actual} is not {expected}"
    );
}

#[track_caller]
pub(crate) fn assert_at(actual: Vec2, x: f32, y: f32) {
    assert!(
        actual.distance(Vec2::new(x, y)) < 2e-5,
        "{actual} is not at ({x}, {y})"
    );
}
