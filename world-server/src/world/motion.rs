//! Motion of a body: it turns on the spot, then moves straight ahead until a solid stops it.

use std::f32::consts::{PI, TAU};

use glam::Vec2;
use proto::readings::Actuation;
use scenario::Body;
use scenario::ids::RobotId;

use super::outline::RayContact;
use super::{Component, Floor, Outline, Penetrability, Push, SKIN_M};

impl Floor {
    /// Turns and then moves a robot by one step. The command is [`limited`]. Returns the push if a bar stopped the robot.
    pub(super) fn turn_and_move(
        &mut self,
        robot: RobotId,
        turn_rad_s: f32,
        speed_m_s: f32,
    ) -> Option<Push> {
        let step_s = self.step.as_secs_f64() as f32;
        let body = &mut self.robots[robot.index()];
        if turn_rad_s != 0.0 {
            body.set_heading(wrap_angle(
                body.component.pose.heading_rad + turn_rad_s * step_s,
            ));
        }
        body.speed_m_s = 0.0;
        let push_m = body.body.push_m_s * step_s;
        let wanted_m = self.distance_on_ground(robot, speed_m_s, step_s);
        if wanted_m <= 0.0 {
            return None;
        }
        let stop = self.free_way(robot, wanted_m);
        let bar = self.first_bar(robot, wanted_m).filter(|(_, at_bar)| {
            let is_nearer = |stop: RayContact| at_bar.distance_m <= stop.distance_m;
            stop.is_none_or(is_nearer)
        });
        let way_m = bar
            .map(|(_, stop)| stop)
            .or(stop)
            .map(|stop| stop.distance_m);
        let way_m = way_m.unwrap_or(wanted_m);
        self.move_ahead(robot, way_m);
        bar.map(|(bar, _)| Push {
            robot,
            bar,
            remaining_m: (wanted_m - way_m).min(push_m),
        })
    }

    /// Moves a robot further in the same step after a bar has given way.
    pub(super) fn move_on(&mut self, robot: RobotId, wanted_m: f32) {
        if wanted_m > 0.0 {
            let bar = self.first_bar(robot, wanted_m).map(|(_, stop)| stop);
            let stop = RayContact::nearer(self.free_way(robot, wanted_m), bar);
            self.move_ahead(robot, stop.map_or(wanted_m, |stop| stop.distance_m));
        }
    }

    /// Moves a robot straight ahead. The caller ensures that the way is free.
    fn move_ahead(&mut self, robot: RobotId, way_m: f32) {
        let step_s = self.step.as_secs_f64() as f32;
        let body = &mut self.robots[robot.index()];
        let from = body.position();
        let to = from + body.ahead * way_m;
        body.component.pose.position = to;
        body.speed_m_s += way_m / step_s;
        if way_m > 0.0 {
            let in_step_m = body.speed_m_s * step_s;
            self.drift.record_move(in_step_m);
            self.update_indexes(robot, to);
            if !self.has_no_neighbor(robot, self.near_m()) {
                self.invalidate_readings_around_body(from, way_m);
            }
        }
    }

    /// Returns the first bar that stops a robot on its way straight ahead.
    fn first_bar(&self, robot: RobotId, max_m: f32) -> Option<(usize, RayContact)> {
        let body = &self.robots[robot.index()];
        let reach_m = max_m + self.body.radius_m + SKIN_M;
        let near = self.bars_near(body.position(), reach_m);
        let stops = near.filter_map(|(index, bar)| {
            let outline = Outline::Bar(bar);
            let stop = outline.sweep(body.position(), self.body.radius_m, body.ahead, max_m)?;
            Some((index, stop))
        });
        stops.reduce(|first, other| {
            if other.1.distance_m < first.1.distance_m {
                other
            } else {
                first
            }
        })
    }

    /// Updates the indexes after a body has moved.
    pub(super) fn update_indexes(&mut self, robot: RobotId, to: Vec2) {
        self.invalidate_readings(robot);
        self.bodies.relocate(robot.index(), to);
        if let Some(range) = &mut self.range {
            range.relocate(robot.index(), to);
        }
    }

    /// Returns the contact that stops a robot on its way straight ahead, without regard to bars; `None` if the way is free.
    pub(super) fn free_way(&self, robot: RobotId, max_m: f32) -> Option<RayContact> {
        let body = &self.robots[robot.index()];
        let reach_m = max_m + self.body.radius_m + SKIN_M;
        let sweep = |nearest: Option<RayContact>, solid: Outline| {
            let stop = solid.sweep(body.position(), self.body.radius_m, body.ahead, max_m);
            RayContact::nearer(nearest, stop)
        };
        let still = if self.space.is_open(body.position(), reach_m) {
            None
        } else {
            let solids = self.space.solids_near(body.position(), reach_m);
            solids.fold(None, sweep)
        };
        if self.has_no_neighbor(robot, reach_m) {
            return still;
        }
        let others = self.solid_neighbors(robot, body.position(), reach_m);
        others.fold(still, sweep)
    }

    /// Returns the same as [`Floor::teammates`] as outlines; empty if robots are no obstacles to each other.
    pub(super) fn solid_neighbors(
        &self,
        robot: RobotId,
        point: Vec2,
        reach_m: f32,
    ) -> impl Iterator<Item = Outline> + '_ {
        let solid = Penetrability(self.body.robot_penetrability).is_solid();
        let others = solid.then(|| self.teammates(robot, point, reach_m));
        others.into_iter().flatten().map(Component::outline)
    }

    /// Returns the bodies of the other robots within reach of a point, and some out of reach.
    pub(super) fn teammates(
        &self,
        robot: RobotId,
        point: Vec2,
        reach_m: f32,
    ) -> impl Iterator<Item = &Component> + '_ {
        let near = self.bodies.near(point, reach_m + self.body.radius_m);
        near.filter(move |(rank, _)| *rank != robot.index())
            .map(|(rank, _)| &self.robots[rank].component)
    }
}

/// Limits a command to the abilities of a body. A speed that is negative or not a number counts as 0.
#[inline(always)]
#[must_use]
pub fn limit_command(body: &Body, command: Actuation) -> Actuation {
    let limit_rad_s = body.turn_deg_s.to_radians();
    Actuation {
        speed_m_s: finite(command.speed_m_s).clamp(0.0, body.speed_m_s),
        turn_rad_s: finite(command.turn_rad_s).clamp(-limit_rad_s, limit_rad_s),
        ..command
    }
}

fn finite(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}

/// Returns an angle normalized to (-π, π].
#[must_use]
pub fn wrap_angle(angle_rad: f32) -> f32 {
    // The remainder of such an angle equals the angle.
    let angle_rad = if angle_rad.abs() <= PI {
        angle_rad
    } else {
        libm::remainderf(angle_rad, TAU)
    };
    if angle_rad <= -PI { PI } else { angle_rad }
}

/// Returns the direction of a vector in the frame of a robot that faces `ahead`, rad in (-π, π].
pub(super) fn bearing(ahead: Vec2, vector: Vec2) -> f32 {
    wrap_angle(libm::atan2f(ahead.perp_dot(vector), ahead.dot(vector)))
}
