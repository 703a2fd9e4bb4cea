//! Coverage of a mission: at least one robot can do every remaining task.

use glam::Vec2;
use proto::control::Phase;
use scenario::Scenario;
use scenario::fault::{ActuatorMode, Fault, FaultGroup};
use scenario::mission::expected_properties::ExpectedProperties;

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
    columns: usize,
    rows: usize,
    free: Vec<bool>,
}

impl Map {
    fn of(scenario: &Scenario, state: &WorldState) -> Self {
        let room = scenario.room;
        let count = |size_m: f32| (size_m / GRID_M) as usize + 1;
        let (columns, rows) = (count(room.width_m), count(room.height_m));
        let radius_m = scenario.body.radius_m;
        let wide_m = radius_m * (1.0 + CLEARANCE_RADII);
        let size = Vec2::new(room.width_m, room.height_m);
        let bodies: Vec<Vec2> = state
            .robots
            .iter()
            .enumerate()
            .filter(|&(rank, robot)| robot.present && !is_operational(scenario, state, rank))
            .map(|(_, robot)| robot.pose.position)
            .collect();
        let is_free = |at: Vec2| {
            let solid = state.rectangles.iter().filter(|rectangle| rectangle.solid);
            at.min(size - at).min_element() >= wide_m
                && solid
                    .into_iter()
                    .all(|rectangle| distance(rectangle, at) >= wide_m)
                && bodies
                    .iter()
                    .all(|body| body.distance(at) >= radius_m + wide_m)
        };
        let places = (0..columns * rows).map(|place| is_free(point(columns, place)));
        Self {
            columns,
            rows,
            free: places.collect(),
        }
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
            let mut places = reached.iter().enumerate().filter(|(_, reached)| **reached);
            places.any(|(place, _)| point(self.columns, place).distance(target) <= within_m)
        };
        let left = state
            .items
            .iter()
            .filter(|item| !is_delivered(promises, item));
        let mut targets = promises.targets.iter();
        targets.all(|target| reaches(target.center, target.radius_m))
            && left
                .into_iter()
                .all(|item| item.carrier.is_some() || reaches(item.position, near_m))
    }

    /// Returns all positions reachable from `from`.
    fn flood(&self, from: Vec2, near_m: f32) -> Vec<bool> {
        let mut reached = vec![false; self.free.len()];
        let mut open: Vec<usize> = (0..self.free.len())
            .filter(|place| {
                self.free[*place] && point(self.columns, *place).distance(from) <= near_m
            })
            .collect();
        while let Some(place) = open.pop() {
            if std::mem::replace(&mut reached[place], true) {
                continue;
            }
            let (column, row) = (place % self.columns, place / self.columns);
            let neighbors = [
                (column > 0).then(|| place - 1),
                (column + 1 < self.columns).then(|| place + 1),
                (row > 0).then(|| place - self.columns),
                (row + 1 < self.rows).then(|| place + self.columns),
            ];
            open.extend(
                neighbors
                    .into_iter()
                    .flatten()
                    .filter(|next| self.free[*next] && !reached[*next]),
            );
        }
        reached
    }
}

/// Returns the position of a grid point, m.
fn point(columns: usize, place: usize) -> Vec2 {
    GRID_M * Vec2::new((place % columns) as f32, (place / columns) as f32)
}
