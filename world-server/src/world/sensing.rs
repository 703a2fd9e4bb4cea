//! Readings of a robot's sensors. Each device is defined in [`proto::readings`].

use glam::Vec2;
use proto::readings::{Hit, Proximity, Readings};
use scenario::ids::RobotId;

use super::floor::Robot;
use super::motion::bearing;
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
        self.proximity(
            robot,
            alone,
            readings.proximity.insert(Proximity::default()),
        );
        readings.ground = Some(self.ground(robot));
        readings.energy_j = self.energy_j(robot);
    }

    /// Returns the distance beyond which a robot does not sense other bodies, m.
    pub(super) fn near_m(&self) -> f32 {
        // The ground sensor reaches less far than the beams.
        self.proximity_reach_m() + SKIN_M
    }

    /// Returns the reach of the avoidance sensor from a robot's center, m. The beams begin at the hull.
    fn proximity_reach_m(&self) -> f32 {
        2.0 * self.body.radius_m + self.sensors.avoidance_range_m
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
        let (center, ahead, left) = (component.pose.position, *ahead, ahead.perp());
        let (radius_m, range_m) = (self.body.radius_m, self.sensors.avoidance_range_m);

        let reach_m = self.proximity_reach_m();
        if alone && self.space.is_open(center, reach_m) {
            return;
        }
        let others = (!alone).then(|| self.solid_neighbors(robot, center, reach_m));
        let solids = self.space.solids_near(center, reach_m);
        let solids = solids.chain(others.into_iter().flatten());
        let solids = solids.filter(|solid| !solid.is_out_of_reach(center, reach_m));

        let mut middle = None;
        // Other beams are rays from the hull: ahead from its sides, sideways from its front, center and rear.
        let ahead_from = [left * radius_m, left * -radius_m];
        let side_from = [ahead * radius_m, Vec2::ZERO, ahead * -radius_m];
        let mut ahead_stops = [None; 2];
        let mut left_stops = [None; 3];
        let mut right_stops = [None; 3];
        for solid in solids {
            middle = RayContact::nearer(middle, solid.sweep(center, radius_m, ahead, range_m));
            let cast = |stop: &mut Option<RayContact>, from: Vec2, direction: Vec2| {
                *stop = RayContact::nearer(
                    *stop,
                    solid.cast_ray(center + from, direction, radius_m + range_m, 0.0),
                );
            };
            for (stop, from) in ahead_stops.iter_mut().zip(ahead_from) {
                cast(stop, from, ahead);
            }
            for (index, from) in side_from.into_iter().enumerate() {
                cast(&mut left_stops[index], from, left);
                cast(&mut right_stops[index], from, -left);
            }
        }

        let hit = |stop: Option<RayContact>, before_edge_m: f32| {
            stop.map(|stop| Hit {
                distance_m: (stop.distance_m - before_edge_m).max(0.0),
                normal_rad: bearing(ahead, stop.normal),
            })
        };
        proximity.ahead = [
            hit(ahead_stops[0], radius_m),
            hit(middle, 0.0),
            hit(ahead_stops[1], radius_m),
        ];
        proximity.left = left_stops.map(|stop| hit(stop, radius_m));
        proximity.right = right_stops.map(|stop| hit(stop, radius_m));
    }
}
