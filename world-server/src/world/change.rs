//! Changes of the world between two steps, by interruption handlers (thesis §3.2.2.2) and by faults.
//!
//! No change creates a new overlap of bodies, except an obstacle that is placed on them.

use glam::Vec2;
use proto::readings::Pose;
use scenario::Obstacle;
use scenario::ids::RobotId;

use super::motion::wrap_angle;
use super::neighbor_cache::NeighborCache;
use super::space::{ROUNDING_M, nearest_place};
use super::{Floor, ObstacleId};

/// The reason why a change of the world is impossible.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChangeError {
    /// A reason given by the mission.
    #[error("{0}")]
    Mission(String),
    /// The body does not fit at the place.
    #[error("the place is outside the border, on a solid obstacle or on another robot")]
    Occupied,
    /// The body fits nowhere in the room.
    #[error("no room is left for the robot")]
    NoRoom,
    /// The robot has no body.
    #[error("the robot is not in the mission")]
    Absent,
    /// The body moves in another world, which sets its pose.
    #[error("the body of the robot moves in another world")]
    External,
    /// The place of a body in another world is not in the room.
    #[error("the place is not in the room")]
    Outside,
    /// The robot has a body already.
    #[error("the robot is in the mission already")]
    Present,
}

impl Floor {
    /// Places a rectangle on the floor: an obstacle, or a patch that changes the speed. It may lie anywhere. A covered robot is
    /// not moved; it can only leave the rectangle.
    pub fn add_obstacle(&mut self, obstacle: &Obstacle) -> ObstacleId {
        self.invalidate_all_readings();
        self.space.add(obstacle)
    }

    /// Removes a rectangle and returns whether it existed. Its id is not reused.
    pub fn remove_obstacle(&mut self, obstacle: ObstacleId) -> bool {
        self.invalidate_all_readings();
        self.space.remove(obstacle)
    }

    /// Moves a robot's body, with its load, to another place. Without a heading the body keeps its own.
    ///
    /// # Errors
    /// If the body does not fit at the place, or the robot has no body.
    pub fn move_robot(
        &mut self,
        robot: RobotId,
        to: Vec2,
        heading_rad: Option<f32>,
    ) -> Result<(), ChangeError> {
        if !self.is_present(robot) {
            return Err(ChangeError::Absent);
        }
        if self.is_external(robot) {
            return Err(ChangeError::External);
        }
        if !self.is_free(robot, to) {
            return Err(ChangeError::Occupied);
        }
        let body = &mut self.robots[robot.index()];
        let from = std::mem::replace(&mut body.component.pose.position, to);
        if let Some(heading_rad) = heading_rad {
            body.set_heading(wrap_angle(heading_rad));
        }
        self.invalidate_readings_around_body(from, 0.0);
        self.jumped(robot, to);
        Ok(())
    }

    /// Adds the body of an absent robot at its start or at the nearest free place. Returns the pose.
    ///
    /// # Errors
    /// If the robot has a body, or there is no room.
    pub fn add_robot(&mut self, robot: RobotId) -> Result<Pose, ChangeError> {
        if self.is_present(robot) {
            return Err(ChangeError::Present);
        }
        let start = self.robots[robot.index()].start;
        let place = nearest_place(start.position, &self.space.room, |place| {
            self.is_free(robot, place)
        });
        let place = place.ok_or(ChangeError::NoRoom)?;
        let body = &mut self.robots[robot.index()];
        body.component.pose.position = place;
        body.set_heading(start.heading_rad);
        body.present = true;
        let pose = body.component.pose;
        self.bodies.insert(robot.index(), place);
        self.jumped(robot, place);
        Ok(pose)
    }

    /// Updates the indexes after a body was placed somewhere.
    pub(super) fn jumped(&mut self, robot: RobotId, to: Vec2) {
        let body = &mut self.robots[robot.index()];
        body.vicinity = NeighborCache::default();
        body.unchanged.invalidate();
        body.jumps += 1;
        self.drift.record_jump(&self.space.room);
        self.update_indexes(robot, to);
        self.invalidate_readings_around_body(to, 0.0);
    }

    pub(super) fn remove_body(&mut self, robot: RobotId) {
        let body = &mut self.robots[robot.index()];
        body.speed_m_s = 0.0;
        if std::mem::replace(&mut body.present, false) {
            let from = body.position();
            self.bodies.remove(robot.index());
            self.invalidate_readings_around_body(from, 0.0);
        }
    }

    /// Switches a robot's power on or off. Without power its body executes no commands and draws no energy.
    pub fn set_powered(&mut self, robot: RobotId, powered: bool) {
        self.robots[robot.index()].powered = powered;
    }

    /// Checks whether a robot's body fits at `center`. It may touch solids, within rounding.
    fn is_free(&self, robot: RobotId, center: Vec2) -> bool {
        let still = self.space.solids_near(center, self.body.radius_m);
        let others = self.solid_neighbors(robot, center, self.body.radius_m);
        still
            .chain(others)
            .all(|solid| solid.surface(center).0 >= self.body.radius_m - ROUNDING_M)
    }
}
