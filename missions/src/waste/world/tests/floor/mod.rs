//! Invariants of the world as a whole.

mod aspects;
mod change;
mod ground;
mod motion;
mod random;
mod sensing;
mod start;

use glam::Vec2;
use proto::mission::Action;
use proto::mission::items::{Gripper, ItemsAction};
use proto::readings::Actuation;
use scenario::ids::RobotId;
use scenario::{Obstacle, Robot, Scenario, Setup, Start};
use world_server::world::{SKIN_M, World};

use super::CleanUp;
use crate::waste::MISSION;
use crate::waste::data::{WasteSection, default_setup};

pub(crate) const BLUE: RobotId = RobotId(0);
pub(crate) const GOLD: RobotId = RobotId(1);

pub(crate) const REPORT: ItemsAction = ItemsAction {
    report: true,
    gripper: Gripper::Keep,
};

/// Creates the default world after changes to the scenario.
pub(crate) fn world(change: impl FnOnce(&mut Scenario)) -> World {
    let mut setup = default_setup(1);
    change(&mut setup.scenario);
    World::new(&setup, MISSION.world)
}

/// Places robots at (x, y, heading in degrees) in a room without items. The first has a side sensor.
pub(crate) fn robots(starts: &[(f32, f32, f32)]) -> impl FnOnce(&mut Scenario) {
    let robot = |(rank, start): (usize, &(f32, f32, f32))| Robot {
        name: format!("r{rank}"),
        side_sensor: rank == 0,
        start: Some(start_at(*start)),
        ..Robot::default()
    };
    let team = starts.iter().enumerate().map(robot).collect();
    |scenario| {
        scenario.robots = team;
        for spill in &mut WasteSection::of_mut(scenario).spills {
            spill.items = 0;
        }
    }
}

pub(crate) fn start_at((x_m, y_m, heading_deg): (f32, f32, f32)) -> Start {
    Start {
        x_m,
        y_m,
        heading_deg,
    }
}

/// Creates a world with these robots, without items, and with these obstacles.
pub(crate) fn room(starts: &[(f32, f32, f32)], obstacles: &[Obstacle]) -> World {
    world(|scenario| {
        robots(starts)(scenario);
        scenario.obstacles = obstacles.to_vec();
    })
}

/// Moves the first spill to a place, m, and changes its number of items, and the radius of all spills, m.
pub(crate) fn spill(scenario: &mut Scenario, at: (f32, f32), items: u32, radius_m: f32) {
    let waste = WasteSection::of_mut(scenario);
    let first = &mut waste.spills[0];
    (first.x_fraction, first.y_fraction) = (at.0 / 12.0, at.1 / 9.0);
    first.items = items;
    waste.spill_radius_m = radius_m;
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

pub(crate) fn solid(x_m: f32, y_m: f32, width_m: f32, height_m: f32) -> Obstacle {
    rectangle(x_m, y_m, width_m, height_m, 0.0)
}

pub(crate) fn drive(speed_m_s: f32, turn_deg_s: f32) -> Option<Actuation> {
    Some(Actuation {
        speed_m_s,
        turn_rad_s: turn_deg_s.to_radians(),
        ..Actuation::default()
    })
}

pub(crate) fn acts(action: impl Into<Action>) -> Option<Actuation> {
    Some(Actuation {
        action: action.into(),
        ..Actuation::default()
    })
}

/// Executes the same commands in a number of steps.
pub(crate) fn run(world: &mut World, steps: usize, commands: &[Option<Actuation>]) {
    for _ in 0..steps {
        world.step(commands);
    }
}

pub(crate) fn position(world: &World, robot: RobotId) -> Vec2 {
    world.pose(robot).position
}

#[track_caller]
pub(crate) fn assert_near(actual: f32, expected: f32) {
    let apart = (actual - expected).abs();
    assert!(apart < 2e-5, "{actual} is not {expected}");
}

#[track_caller]
pub(crate) fn assert_at(actual: Vec2, x: f32, y: f32) {
    let apart = actual.distance(Vec2::new(x, y));
    assert!(apart < 2e-5, "{actual} is not at ({x}, {y})");
}
