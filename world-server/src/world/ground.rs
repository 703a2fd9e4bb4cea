//! Effect of the floor on speed (thesis §3.2.2.1).
//!
//! The slowest component at a point determines the penetrability there. Neutral components have no effect. Robots that are
//! not solid to each other count as well.

use glam::Vec2;
use proto::readings::Ground;
use scenario::ids::RobotId;

use super::{Component, Floor, Penetrability};

impl Floor {
    /// Returns the distance that a robot moves in a given time if no solid stops it, m. The factor of a patch applies while the
    /// robot's center is on it.
    pub(super) fn distance_on_ground(&self, robot: RobotId, speed_m_s: f32, time_s: f32) -> f32 {
        if speed_m_s <= 0.0 {
            return 0.0;
        }
        let body = &self.robots[robot.index()];
        let mut way_m = 0.0;
        let mut left_s = time_s;
        loop {
            let mut factor: Option<f32> = None;
            let mut edge_m = f32::INFINITY;
            for component in self.components_for(
                robot,
                false,
                body.position(),
                f32::INFINITY,
                Penetrability::changes_speed,
            ) {
                let Some((enter_m, leave_m)) =
                    component.outline().chord(body.position(), body.ahead)
                else {
                    continue;
                };
                if enter_m <= way_m && way_m < leave_m {
                    factor = Some(slower(factor, component.penetrability));
                    edge_m = edge_m.min(leave_m);
                } else if way_m < enter_m {
                    edge_m = edge_m.min(enter_m);
                }
            }
            let actual_m_s = speed_m_s * factor.unwrap_or(1.0);
            if way_m + actual_m_s * left_s <= edge_m {
                // The room limits every way, and an infinite way has no end point.
                return (way_m + actual_m_s * left_s).min(self.space.room.size().element_sum());
            }
            left_s -= (edge_m - way_m) / actual_m_s;
            way_m = edge_m;
        }
    }

    /// Returns the reading of the ground sensor. Beyond the border the ground is solid.
    pub(super) fn ground(&self, robot: RobotId) -> Ground {
        let body = &self.robots[robot.index()];
        let ahead_m = 2.0 * self.body.radius_m;
        let alone = self.has_no_neighbor(robot, ahead_m);
        if alone && self.space.is_open(body.position(), ahead_m) {
            return Ground {
                here: Penetrability::NEUTRAL.0,
                ahead: Penetrability::NEUTRAL.0,
            };
        }
        let ahead = body.position() + body.ahead * ahead_m;
        Ground {
            here: self.penetrability_at(body.position(), robot, alone),
            ahead: self.penetrability_at(ahead, robot, alone),
        }
    }

    fn penetrability_at(&self, point: Vec2, robot: RobotId, alone: bool) -> f32 {
        if !self.space.room.contains(point) {
            return 0.0;
        }
        if self
            .bars_near(point, 0.0)
            .any(|(_, bar)| bar.distance_to_point(point) <= 0.0)
        {
            return 0.0;
        }
        let changes_anything = |value: Penetrability| value != Penetrability::NEUTRAL;
        let there = self
            .components_for(robot, alone, point, 0.0, changes_anything)
            .filter(|component| component.outline().contains(point));
        there
            .fold(None, |slowest, component| {
                Some(slower(slowest, component.penetrability))
            })
            .unwrap_or(1.0)
    }

    /// Returns the components within reach of a point whose penetrability `matters`, and some out of reach. Other bodies are
    /// included unless the robot is alone.
    fn components_for(
        &self,
        robot: RobotId,
        alone: bool,
        point: Vec2,
        reach_m: f32,
        matters: fn(Penetrability) -> bool,
    ) -> impl Iterator<Item = &Component> + '_ {
        // All bodies have the same penetrability.
        let bodies = !alone && matters(Penetrability(self.body.robot_penetrability));
        let others = bodies.then(|| self.teammates(robot, point, reach_m));
        let rectangles = self.space.rectangles().iter();
        rectangles
            .filter(move |rectangle| matters(rectangle.penetrability))
            .chain(others.into_iter().flatten())
    }
}

fn slower(slowest: Option<f32>, other: Penetrability) -> f32 {
    slowest.map_or(other.0, |slowest| slowest.min(other.0))
}
