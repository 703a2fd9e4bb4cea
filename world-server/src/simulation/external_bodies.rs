//! Bodies that move in another world. Their poses are inputs, and their commands go to that world.

use glam::Vec2;
use proto::readings::{Actuation, Pose};
use run_log::{BodyInput, Input};
use scenario::ids::RobotId;

use super::Simulation;
use crate::world::limit_command;

impl Simulation {
    /// Sets the pose of a body in the current tick. It takes effect after all changes of the tick and before the sensing, so its
    /// time of arrival has no effect. The last pose of a body counts.
    pub fn place_body(&mut self, body: BodyInput) {
        self.placements.retain(|other| other.robot != body.robot);
        self.placements.push(body);
    }

    /// Applies the poses of the current tick. A pose that is impossible, or of a robot without a body, has no effect and is no
    /// input.
    pub(super) fn place_bodies(&mut self) {
        for body in std::mem::take(&mut self.placements) {
            let Some(robot) = self.robot_named(&body.robot) else {
                continue;
            };
            let pose = Pose {
                position: Vec2::new(body.x_m, body.y_m),
                heading_rad: body.heading_rad,
            };
            let beams = body.scan.as_ref().map(|scan| scan.beams);
            if self.world.place_body(robot, pose, beams).is_ok() {
                self.unscripted = true;
                self.inputs.push(Input::Body(body));
            }
        }
    }

    /// Returns the command of a robot in the last ended tick, within the limits of its body and changed by the faults of its
    /// actuators. It stands still without a counting report or without power.
    #[must_use]
    pub fn executed_command(&self, robot: RobotId) -> Actuation {
        let command = self.ended.commands.get(robot.index()).copied().flatten();
        let command = command.filter(|_| self.world.can_act(robot));
        limit_command(self.world.body_of(robot), command.unwrap_or_default())
    }
}
