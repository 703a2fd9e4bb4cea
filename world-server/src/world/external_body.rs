//! Bodies that move in another world, which sets their poses before each step. This world executes only their actions.

use proto::readings::{Pose, Proximity};
use scenario::ids::RobotId;

use super::motion::wrap_angle;
use super::{ChangeError, Floor};

impl Floor {
    /// Sets the pose of a body for the next step, in which the body does not move by itself. Its speed is the distance from the
    /// previous pose of the other world per step. The pose may overlap solids, because the other world decides where bodies fit.
    /// With a scan, the reading of collision avoidance is that of the other world, too.
    ///
    /// # Errors
    /// If the robot has no body, or the pose is not finite or not in the room. Nothing has changed then.
    pub fn place_body(
        &mut self,
        robot: RobotId,
        pose: Pose,
        scan: Option<Proximity>,
    ) -> Result<(), ChangeError> {
        if !self.is_present(robot) {
            return Err(ChangeError::Absent);
        }
        // A comparison with NaN is false.
        if !self.space.room.contains(pose.position) || !pose.heading_rad.is_finite() {
            return Err(ChangeError::Outside);
        }
        let (now, step_s) = (self.now, self.step.as_secs_f64() as f32);
        let body = &mut self.robots[robot.index()];
        let from = std::mem::replace(&mut body.component.pose.position, pose.position);
        body.set_heading(wrap_angle(pose.heading_rad));
        // The way from the start pose of this world to the first one of the other world takes no time.
        body.speed_m_s = match body.placed_at {
            Some(_) => pose.position.distance(from) / step_s,
            None => 0.0,
        };
        body.placed_at = Some(now);
        body.scan = scan.map(Box::new);
        if pose.position != from {
            self.invalidate_readings_around_body(from, 0.0);
            self.jumped(robot, pose.position);
        }
        Ok(())
    }

    /// Checks whether another world has set the pose of a body for the current step.
    pub(super) fn is_placed(&self, robot: RobotId) -> bool {
        self.robots[robot.index()].placed_at == Some(self.now)
    }

    /// Returns the beams of a robot in the current step, if another world has measured them.
    pub(super) fn scan_of(&self, robot: RobotId) -> Option<&Proximity> {
        let scan = self.robots[robot.index()].scan.as_deref();
        scan.filter(|_| self.is_placed(robot))
    }

    /// Checks whether a body moves in another world: that world has set its pose for this step or the previous one.
    pub(super) fn is_external(&self, robot: RobotId) -> bool {
        let placed_at = self.robots[robot.index()].placed_at;
        placed_at.is_some_and(|at| self.now.since(at) <= self.step)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proto::readings::{Actuation, Hit, Readings};
    use scenario::testkit::default_setup;

    use super::*;
    use crate::drill::DRILL;
    use crate::world::World;

    const BLUE: RobotId = RobotId(0);

    fn pose(x_m: f32, y_m: f32) -> Pose {
        Pose {
            position: Vec2::new(x_m, y_m),
            heading_rad: 0.5,
        }
    }

    #[test]
    fn a_placed_body_does_not_move_by_itself_in_that_step() {
        let mut world = World::new(&default_setup(1), DRILL);
        let ahead = Some(Actuation {
            speed_m_s: 0.2,
            ..Actuation::default()
        });
        world.place_body(BLUE, pose(3.0, 4.0), None).unwrap();
        assert_eq!(world.speed_m_s(BLUE), 0.0);
        world.step(&[ahead]);
        world.place_body(BLUE, pose(3.03, 4.04), None).unwrap();
        // 0.05 m in a step of 50 ms.
        assert!((world.speed_m_s(BLUE) - 1.0).abs() < 1e-4);
        world.step(&[ahead]);
        assert_eq!(world.pose(BLUE), pose(3.03, 4.04));
        // A step without a pose moves the body again, as in a branch of the run.
        world.step(&[ahead]);
        assert_ne!(world.pose(BLUE), pose(3.03, 4.04));
    }

    #[test]
    fn a_scan_replaces_the_beams_for_one_step() {
        let mut world = World::new(&default_setup(1), DRILL);
        let hit = Hit {
            distance_m: 0.1,
            normal_rad: 3.0,
        };
        let scan = Proximity {
            ahead: [None, Some(hit), None],
            ..Proximity::default()
        };
        // Nothing is near.
        let place = pose(6.0, 4.5);
        let mut readings = Readings::default();
        let mut beams = |world: &mut World, scan: Option<Option<Proximity>>| {
            if let Some(scan) = scan {
                world.place_body(BLUE, place, scan).unwrap();
            }
            if !world.readings_are_valid(BLUE) {
                world.write_readings(BLUE, &mut readings);
            }
            world.step(&[]);
            readings.proximity
        };
        let free = Some(Proximity::default());
        assert_eq!(beams(&mut world, Some(None)), free);
        assert_eq!(beams(&mut world, Some(Some(scan))), Some(scan));
        assert_eq!(beams(&mut world, Some(Some(scan))), Some(scan));
        // A branch of the run has no more scans, and the body stands.
        assert_eq!(beams(&mut world, None), free);
        assert_eq!(beams(&mut world, Some(Some(scan))), Some(scan));
        assert_eq!(beams(&mut world, Some(None)), free);
    }

    #[test]
    fn impossible_poses_are_refused_and_faults_do_not_move_the_body() {
        let mut world = World::new(&default_setup(1), DRILL);
        let before = world.pose(BLUE);
        for wrong in [
            pose(-0.1, 4.0),
            pose(f32::NAN, 4.0),
            pose(3.0, f32::INFINITY),
            Pose {
                heading_rad: f32::NAN,
                ..pose(3.0, 4.0)
            },
        ] {
            assert_eq!(
                world.place_body(BLUE, wrong, None),
                Err(ChangeError::Outside)
            );
        }
        assert_eq!(world.pose(BLUE), before);
        assert_eq!(world.move_robot(BLUE, Vec2::new(6.0, 4.0), None), Ok(()));

        world.place_body(BLUE, pose(3.0, 4.0), None).unwrap();
        let moved = world.move_robot(BLUE, Vec2::new(6.0, 4.0), None);
        assert_eq!(moved, Err(ChangeError::External));
        world.remove_robot(BLUE);
        assert_eq!(
            world.place_body(BLUE, pose(3.0, 4.0), None),
            Err(ChangeError::Absent)
        );
    }
}
