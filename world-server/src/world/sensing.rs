//! Readings of a robot's sensors. Each device is defined in [`proto::readings`].

use glam::Vec2;
use proto::readings::{Proximity, Readings};
use scenario::ids::RobotId;

use super::beams::{BeamOrigin, beam_reach_m};
use super::floor::Robot;
use super::outline::RayContact;
use super::{Floor, SKIN_M};

impl Floor {
    /// Writes the readings of the devices that a robot has in every mission to `readings`.
    pub(super) fn look(&self, robot: RobotId, readings: &mut Readings) {
        let body = &self.robots[robot.index()];
        let position = body.position();
        let alone = !self.may_have_neighbor(robot, self.near_m());
        readings.pose = Some(body.component.pose);
        readings.front_border = Some(self.border(position, body.ahead));
        readings.side_border = body
            .side_sensor
            .then(|| self.border(position, body.ahead.perp()));
        let proximity = readings.proximity.insert(Proximity::default());
        match self.scan_of(robot) {
            Some(scanned) => *proximity = *scanned,
            None => self.proximity(robot, alone, proximity),
        }
        readings.ground = Some(self.ground(robot));
        readings.energy_j = self.energy_j(robot);
    }

    /// Returns the distance beyond which a robot does not sense other bodies, m.
    pub(super) fn near_m(&self) -> f32 {
        // The ground sensor reaches less far than the beams.
        beam_reach_m(self.body.radius_m, self.sensors.avoidance_range_m) + SKIN_M
    }

    /// Returns the distance from the edge of a body to the border in one direction; `None` out of range.
    fn border(&self, position: Vec2, direction: Vec2) -> Option<f32> {
        let reach_m = self.body.radius_m + self.sensors.border_range_m;
        if !self.space.is_near_border(position, reach_m) {
            return None;
        }
        let walls = self.space.walls_near(position, reach_m);
        let stops = walls.map(|wall| wall.cast_ray(position, direction, reach_m, 0.0));
        let stop = stops.fold(None, RayContact::nearer)?;
        Some((stop.distance_m - self.body.radius_m).max(0.0))
    }

    /// Writes the contacts to `proximity`, whose beams are all free before. `alone` means that no other body is near.
    fn proximity(&self, robot: RobotId, alone: bool, proximity: &mut Proximity) {
        let Robot {
            component, ahead, ..
        } = &self.robots[robot.index()];
        let center = component.pose.position;
        let origin = BeamOrigin {
            center,
            ahead: *ahead,
            radius_m: self.body.radius_m,
            range_m: self.sensors.avoidance_range_m,
        };
        let reach_m = origin.reach_m();
        if alone && self.space.is_open(center, reach_m) {
            return;
        }
        let others = (!alone).then(|| self.solid_neighbors(robot, center, reach_m));
        let solids = self.space.solids_near(center, reach_m);
        let solids = solids.chain(others.into_iter().flatten());
        origin.cast(solids, proximity);
    }
}
