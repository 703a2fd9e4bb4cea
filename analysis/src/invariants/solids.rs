//! Invariant: bodies do not overlap the border, obstacles or each other.
//!
//! A fault may put an obstacle on a robot. The robot is not moved, but it may only leave the obstacle, not get deeper
//! into it.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec2;
use scenario::{Obstacle, Scenario};
use world_server::world::{ComponentId, Grid};

use super::{Rectangle, RobotState, WorldState};

/// Tolerance for rounding, m. Bodies stop 1 mm before contact, or half of that at a grazing angle.
const ROUNDING_M: f32 = 1e-4;
/// The tolerance in rooms far from (0, 0), as a multiple of the resolution of coordinates. Two bodies move in two axes.
const RESOLUTIONS: f32 = 4.0;

#[derive(Clone, Debug, Default)]
pub struct Solids {
    known: BTreeSet<ComponentId>,
    /// Distance of a robot's center, by rank, from the surface of an obstacle that was put on it, m; negative inside.
    covered: BTreeMap<(usize, ComponentId), f32>,
}

impl Solids {
    /// Checks all bodies after a tick. The error describes the violation.
    pub fn check(&mut self, scenario: &Scenario, state: &WorldState) -> Result<(), String> {
        let radius_m = scenario.body.radius_m;
        let rounding_m = ROUNDING_M.max(RESOLUTIONS * scenario.room.resolution_m());
        let name = |rank: usize| scenario.robots[rank].name.as_str();
        let bodies: Vec<(usize, &RobotState)> = state
            .robots
            .iter()
            .enumerate()
            .filter(|(_, robot)| robot.present)
            .collect();
        let mut covered = BTreeMap::new();
        for &(rank, body) in &bodies {
            let at = body.pose.position;
            let to_border_m = scenario.room.to_border_m(at);
            if to_border_m < radius_m - rounding_m {
                let deep_m = radius_m - to_border_m;
                return Err(format!("{} is {deep_m} m in the border", name(rank)));
            }
            for rectangle in state.rectangles.iter().filter(|rectangle| rectangle.solid) {
                let way_m = distance(rectangle, at);
                if way_m >= radius_m - rounding_m {
                    continue;
                }
                let key = (rank, rectangle.id);
                let before_m = self.covered.get(&key).copied();
                let is_new = !self.known.contains(&rectangle.id);
                let leaves = before_m.is_some_and(|before_m| way_m >= before_m - rounding_m);
                if !is_new && !leaves {
                    let (robot, obstacle, deep_m) = (name(rank), rectangle.id, radius_m - way_m);
                    return Err(match before_m {
                        None => format!("{robot} is {deep_m} m in {obstacle}"),
                        Some(_) => format!("{robot} gets deeper into {obstacle}, {deep_m} m"),
                    });
                }
                // Rounding errors must not accumulate.
                covered.insert(key, before_m.map_or(way_m, |before_m| way_m.max(before_m)));
            }
        }
        if scenario.body.robot_penetrability <= Obstacle::SOLID {
            let least_m = 2.0 * radius_m - rounding_m;
            let mut before = Grid::new(&scenario.room, least_m, state.robots.len());
            for &(rank, body) in &bodies {
                let at = body.pose.position;
                let near = before.near(at, least_m);
                let ways = near.map(|(other, teammate)| (other, at.distance(teammate)));
                let overlaps = ways.filter(|(_, way_m)| *way_m < least_m);
                if let Some((other, way_m)) = overlaps.min_by_key(|(other, _)| *other) {
                    let deep_m = 2.0 * radius_m - way_m;
                    let (one, other) = (name(other), name(rank));
                    return Err(format!("{one} and {other} overlap by {deep_m} m"));
                }
                before.insert(rank, at);
            }
        }
        self.covered = covered;
        self.known = state
            .rectangles
            .iter()
            .map(|rectangle| rectangle.id)
            .collect();
        Ok(())
    }
}

/// Returns the distance of a point from a rectangle's surface, m; negative inside.
pub(super) fn distance(rectangle: &Rectangle, point: Vec2) -> f32 {
    let beyond = (rectangle.min - point).max(point - rectangle.max);
    let deepest = beyond.max_element();
    if deepest > 0.0 {
        beyond.max(Vec2::ZERO).length()
    } else {
        deepest
    }
}
