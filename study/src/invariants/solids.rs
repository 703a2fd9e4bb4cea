//! Bodies overlap nothing solid: neither the border, nor obstacles, nor each other.
//!
//! An obstacle may be put on a robot, by a fault. That robot is not moved, but it can only leave: it never gets deeper into it.

use std::collections::{BTreeMap, BTreeSet};

use alliance_proto::scenario::Scenario;
use glam::Vec2;
use world_server::world::ComponentId;

use super::{Rectangle, RobotState, WorldState};

/// Overlaps that rounding makes, m. Bodies stop a millimeter short of contact, or half of one where they graze.
const ROUNDING_M: f32 = 1e-4;

/// What is known of solids so far.
#[derive(Clone, Debug, Default)]
pub struct Solids {
    known: BTreeSet<ComponentId>,
    /// How far the center of a robot, by its rank, is from the surface of an obstacle that was put on it, m; negative inside.
    covered: BTreeMap<(usize, ComponentId), f32>,
}

impl Solids {
    /// Looks at them after a tick.
    ///
    /// # Errors
    /// What does not hold.
    pub fn check(&mut self, scenario: &Scenario, state: &WorldState) -> Result<(), String> {
        let radius_m = scenario.body.radius_m;
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
            let size = Vec2::new(scenario.room.width_m, scenario.room.height_m);
            let to_border_m = at.min(size - at).min_element();
            if to_border_m < radius_m - ROUNDING_M {
                let deep_m = radius_m - to_border_m;
                return Err(format!("{} is {deep_m} m in the border", name(rank)));
            }
            for rectangle in state.rectangles.iter().filter(|it| it.solid) {
                let way_m = distance(rectangle, at);
                if way_m >= radius_m - ROUNDING_M {
                    continue;
                }
                let key = (rank, rectangle.id);
                let before_m = self.covered.get(&key).copied();
                let is_new = !self.known.contains(&rectangle.id);
                let leaves = before_m.is_some_and(|before_m| way_m >= before_m - ROUNDING_M);
                if !is_new && !leaves {
                    let (who, what, deep_m) = (name(rank), rectangle.id, radius_m - way_m);
                    return Err(match before_m {
                        None => format!("{who} is {deep_m} m in {what}"),
                        Some(_) => format!("{who} gets deeper into {what}, {deep_m} m"),
                    });
                }
                // Rounding does not add up.
                covered.insert(key, before_m.map_or(way_m, |before_m| way_m.max(before_m)));
            }
        }
        // As for all else: up to 0.1 nothing can enter.
        if scenario.body.robot_penetrability <= 0.1 {
            for (place, &(rank, body)) in bodies.iter().enumerate() {
                for &(other, teammate) in &bodies[..place] {
                    let way_m = body.pose.position.distance(teammate.pose.position);
                    if way_m < 2.0 * radius_m - ROUNDING_M {
                        let deep_m = 2.0 * radius_m - way_m;
                        let (one, other) = (name(other), name(rank));
                        return Err(format!("{one} and {other} overlap by {deep_m} m"));
                    }
                }
            }
        }
        self.covered = covered;
        self.known = state.rectangles.iter().map(|it| it.id).collect();
        Ok(())
    }
}

/// Distance of a point from a rectangle's surface, m; negative inside.
pub(super) fn distance(rectangle: &Rectangle, point: Vec2) -> f32 {
    let beyond = (rectangle.min - point).max(point - rectangle.max);
    let deepest = beyond.max_element();
    if deepest > 0.0 {
        beyond.max(Vec2::ZERO).length()
    } else {
        deepest
    }
}
