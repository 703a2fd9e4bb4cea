//! Promises of the world as a whole.

mod aspects;
mod change;
mod ground;
mod motion;
mod random;
mod sensing;
mod start;
mod waste;

use alliance_proto::ids::RobotId;
use alliance_proto::readings::{Actuation, Gripper};
use alliance_proto::scenario::{Obstacle, Robot, Scenario, Setup, Start};
use glam::Vec2;

use super::{World, WorldEvent};

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);

/// The default scenario after some changes.
fn world(change: impl FnOnce(&mut Scenario)) -> World {
    let mut setup = Setup::default_for(1);
    change(&mut setup.scenario);
    World::new(&setup)
}

/// Robots at these places (x, y, heading in degrees), the first with a side sensor, in a room without items.
fn robots(starts: &[(f32, f32, f32)]) -> impl FnOnce(&mut Scenario) {
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
        for spill in &mut scenario.waste.spills {
            spill.items = 0;
        }
    }
}

fn rectangle(x_m: f32, y_m: f32, width_m: f32, height_m: f32, penetrability: f32) -> Obstacle {
    Obstacle {
        x_m,
        y_m,
        width_m,
        height_m,
        penetrability,
    }
}

fn drive(speed_m_s: f32, turn_deg_s: f32) -> Option<Actuation> {
    Some(Actuation {
        speed_m_s,
        turn_rad_s: turn_deg_s.to_radians(),
        ..Actuation::default()
    })
}

fn gripper(gripper: Gripper) -> Option<Actuation> {
    Some(Actuation {
        gripper,
        ..Actuation::default()
    })
}

fn position(world: &World, robot: RobotId) -> Vec2 {
    world.pose(robot).position
}

#[track_caller]
fn assert_near(actual: f32, expected: f32) {
    assert!(
        (actual - expected).abs() < 2e-5,
        "{actual} is not {expected}"
    );
}

#[track_caller]
fn assert_at(actual: Vec2, x: f32, y: f32) {
    assert!(
        actual.distance(Vec2::new(x, y)) < 2e-5,
        "{actual} is not at ({x}, {y})"
    );
}
