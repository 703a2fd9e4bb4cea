//! Coverage of a mission: at least one robot can do every remaining task.

use std::collections::BTreeSet;

use glam::Vec2;
use pathfinding::grid::Grid;
use proto::control::Phase;
use scenario::fault::{ActuatorMode, Fault, FaultGroup};
use scenario::mission::expected_properties::ExpectedProperties;
use scenario::{Room, Scenario};

use super::solids::distance;
use super::{RobotState, WorldState, is_delivered};

/// Grid spacing of the path search, m.
const GRID_M: f32 = 0.1;

/// Required clearance on each side of the body, in body radii. Robots need not pass narrower gaps.
const CLEARANCE_RADII: f32 = 0.5;

/// Returns whether some robot can do every task and no condition prevents it. Such conditions are a robot that
/// permanently sends false information, and an item in a gripper that never opens.
#[must_use]
pub fn is_covered(scenario: &Scenario, state: &WorldState) -> bool {
    let sound = |rank: usize| is_operational(scenario, state, rank);
    let kept = state.items.iter().any(|item| {
        let carrier = item.carrier.map(|robot| robot.index());
        carrier.is_some_and(|rank| !sound(rank))
    });
    let lies = state.faults.iter().any(|fault| {
        fault.phase == Phase::InForce
            && match &fault.order.fault {
                // Wrong positions, false completion, or a body that does not follow its controller.
                Fault::Actuator(fault) => fault.mode != ActuatorMode::Dead,
                Fault::Power(_) | Fault::Skill(_) => false,
                other => other.group() == FaultGroup::Robot,
            }
    });
    !kept && !lies && (0..state.robots.len()).any(sound)
}

/// Returns whether a robot, by rank, has an agent and a body that executes commands. Radio faults do not matter.
#[must_use]
pub fn is_operational(scenario: &Scenario, state: &WorldState, rank: usize) -> bool {
    let (robot, name) = (&state.robots[rank], scenario.robots[rank].name.as_str());
    let broken = state.faults.iter().any(|fault| {
        let impairs = fault.order.fault.group() == FaultGroup::Robot
            && !matches!(fault.order.fault, Fault::Skill(_));
        fault.phase == Phase::InForce && impairs && fault.order.fault.robot() == Some(name)
    });
    robot.present && robot.takes_part && robot.energy_j.is_none_or(|left| left > 0.0) && !broken
}

/// Returns whether a sound robot has paths to all remaining items and other targets, around all static obstacles.
#[must_use]
pub fn is_within_reach(
    scenario: &Scenario,
    promises: &ExpectedProperties,
    state: &WorldState,
) -> bool {
    let sound = |rank: &usize| is_operational(scenario, state, *rank);
    let map = Map::of(scenario, state);
    (0..state.robots.len())
        .filter(sound)
        .any(|rank| map.reaches_all(scenario, promises, state, &state.robots[rank]))
}

/// The grid positions where the center of a body fits.
struct Map {
    grid: Grid,
    room: Room,
}

impl Map {
    fn of(scenario: &Scenario, state: &WorldState) -> Self {
        let room = scenario.room;
        let count = |size_m: f32| (size_m / GRID_M) as usize + 1;
        let radius_m = scenario.body.radius_m;
        let wide_m = radius_m * (1.0 + CLEARANCE_RADII);
        let robots = state.robots.iter().enumerate();
        let bodies =
            robots.filter(|&(rank, robot)| robot.present && !is_operational(scenario, state, rank));
        let bodies: Vec<Vec2> = bodies.map(|(_, robot)| robot.pose.position).collect();
        let is_free = |at: Vec2| {
            let mut solid = state.rectangles.iter().filter(|rectangle| rectangle.solid);
            let mut bodies = bodies.iter();
            room.to_border_m(at) >= wide_m
                && solid.all(|rectangle| distance(rectangle, at) >= wide_m)
                && bodies.all(|body| body.distance(at) >= radius_m + wide_m)
        };
        let mut grid = Grid::new(count(room.width_m), count(room.height_m));
        grid.fill();
        for place in grid
            .clone()
            .iter()
            .filter(|place| !is_free(point(&room, *place)))
        {
            grid.remove_vertex(place);
        }
        Self { grid, room }
    }

    fn reaches_all(
        &self,
        scenario: &Scenario,
        promises: &ExpectedProperties,
        state: &WorldState,
        robot: &RobotState,
    ) -> bool {
        let body = scenario.body;
        // The path starts at the nearest wide position, because the robot may stand at a wall. It ends where the arm
        // and one step suffice.
        let near_m = body.radius_m + body.reach_m + CLEARANCE_RADII * body.radius_m;
        let reached = self.flood(robot.pose.position, near_m);
        let reaches = |target: Vec2, within_m: f32| {
            let mut places = reached.iter();
            places.any(|place| point(&self.room, *place).distance(target) <= within_m)
        };
        let items = state.items.iter();
        let mut left = items.filter(|item| !is_delivered(promises, item));
        let mut targets = promises.targets.iter();
        targets.all(|target| reaches(target.center, target.radius_m))
            && left.all(|item| item.carrier.is_some() || reaches(item.position, near_m))
    }

    /// Returns all positions reachable from `from`.
    fn flood(&self, from: Vec2, near_m: f32) -> BTreeSet<(usize, usize)> {
        let mut reached = BTreeSet::new();
        let starts = self.grid.iter();
        for start in starts.filter(|place| point(&self.room, *place).distance(from) <= near_m) {
            if !reached.contains(&start) {
                reached.extend(self.grid.bfs_reachable(start, |_| true));
            }
        }
        reached
    }
}

/// Returns the position of a grid point, m.
fn point(room: &Room, (column, row): (usize, usize)) -> Vec2 {
    room.low() + GRID_M * Vec2::new(column as f32, row as f32)
}
