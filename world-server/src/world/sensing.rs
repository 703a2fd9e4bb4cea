//! What a robot's sensors read (DESIGN §7; each device is defined in [`alliance_proto::readings`]).

use alliance_proto::ids::{ItemId, RobotId};
use alliance_proto::readings::{Hit, Proximity, Readings, SensedWaste, WASTE_MOST, Zone};
use glam::Vec2;

use super::motion::bearing;
use super::outline::Stop;
use super::vicinity::{Circle, SKIRT_M, WASTE_SKIRT_M};
use super::{Robot, SKIN_M, World};

impl World {
    /// What a robot senses now. All devices that it has are intact here: faults act on the readings.
    #[must_use]
    pub fn readings(&self, robot: RobotId) -> Readings {
        let mut readings = Readings::default();
        self.look(robot, &mut readings);
        readings
    }

    /// Writes to `readings` what a robot senses now, see [`World::readings`]: in place, for small writes followed by a
    /// copy of the whole would cause a store-forwarding stall.
    pub fn sense(&self, robot: RobotId, readings: &mut Readings) {
        self.look(robot, readings);
        let vicinity = &self.robots[robot.index()].vicinity;
        // Energy changes by itself.
        vicinity.unchanged.set(!self.has_aspects);
    }

    fn look(&self, robot: RobotId, readings: &mut Readings) {
        let body = &self.robots[robot.index()];
        let position = body.position();
        let alone = !self.may_meet(robot, self.near_m());
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
        self.waste_near(body, readings.waste.insert(SensedWaste::new()));
        readings.zone = Some(self.zone(body));
        readings.report_site = Some(self.waste.is_report_site(position));
        readings.holding = Some(body.carrying.is_some());
        readings.ground = Some(self.ground(robot));
        readings.energy_j = self.energy_j(robot);
    }

    /// A body that is farther from a robot than this is not sensed, m.
    pub(super) fn near_m(&self) -> f32 {
        // The ground that is sensed ahead is nearer than what the beams reach.
        self.proximity_reach_m() + SKIN_M
    }

    /// How far from a robot's center its avoidance sensor reaches, m: the beams begin at the hull.
    fn proximity_reach_m(&self) -> f32 {
        2.0 * self.body.radius_m + self.sensors.avoidance_range_m
    }

    /// Distance from the edge of a body to the border in that direction, within range.
    fn border(&self, position: Vec2, direction: Vec2) -> Option<f32> {
        let reach_m = self.body.radius_m + self.sensors.border_range_m;
        if !self.space.is_near_border(position, reach_m) {
            return None;
        }
        let walls = self.space.walls_near(position, reach_m);
        let stops = walls.map(|wall| wall.cast_ray(position, direction, reach_m, 0.0));
        let stop = stops.fold(None, Stop::nearer)?;
        Some((stop.way_m - self.body.radius_m).max(0.0))
    }

    /// Writes what is near to `proximity`, where all beams are free. `alone`: no other body is near.
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
        let others = (!alone).then(|| self.solid_teammates(robot, center, reach_m));
        let solids = self.space.solids_near(center, reach_m);
        let solids = solids.chain(others.into_iter().flatten());
        let solids = solids.filter(|solid| !solid.is_beyond(center, reach_m));

        let mut middle = None;
        // The other beams are rays from the hull: of the two ahead from its sides, of the rest from its front, center and rear.
        let ahead_from = [left * radius_m, left * -radius_m];
        let side_from = [ahead * radius_m, Vec2::ZERO, ahead * -radius_m];
        let mut ahead_stops = [None; 2];
        let mut left_stops = [None; 3];
        let mut right_stops = [None; 3];
        for solid in solids {
            middle = Stop::nearer(middle, solid.sweep(center, radius_m, ahead, range_m));
            let cast = |stop: &mut Option<Stop>, from: Vec2, direction: Vec2| {
                *stop = Stop::nearer(
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

        let hit = |stop: Option<Stop>, before_edge_m: f32| {
            stop.map(|stop| Hit {
                distance_m: (stop.way_m - before_edge_m).max(0.0),
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

    /// What is under a robot's center.
    fn zone(&self, body: &Robot) -> Zone {
        let position = body.position();
        let (circle, zone) = body.vicinity.zone.get();
        if circle.contains(position) {
            return zone;
        }
        let (zone, edge_m) = self.waste.zone_within(position, SKIRT_M);
        let circle = Circle::new(position, edge_m);
        body.vicinity.zone.set((circle, zone));
        zone
    }

    /// How far from a robot's center its waste sensor reaches, m.
    pub(super) fn waste_reach_m(&self) -> f32 {
        self.body.radius_m + self.sensors.waste_range_m
    }

    /// The nearest items on the floor within range, nearest first, in the robot's frame.
    fn waste_near(&self, body: &Robot, sensed: &mut SensedWaste) {
        let position = body.position();
        if body.vicinity.wasteless.get().contains(position) {
            return;
        }
        let reach_m = self.waste_reach_m();
        let far_m = reach_m + WASTE_SKIRT_M;
        let mut nearest = Nearest::default();
        let mut least = far_m * far_m;
        self.waste.near(position, far_m).for_each(|(item, at)| {
            let offset = at - position;
            let squared = offset.length_squared();
            least = least.min(squared);
            if squared <= reach_m * reach_m {
                nearest.take(item, offset);
            }
        });
        let wasteless = Circle::new(position, least.sqrt() - reach_m);
        body.vicinity.wasteless.set(wasteless);
        let left = body.ahead.perp();
        let in_frame = |offset: &Vec2| Vec2::new(body.ahead.dot(*offset), left.dot(*offset));
        sensed.extend(nearest.offsets().iter().map(in_frame));
    }
}

/// The nearest of some items, nearest first; of two at the same distance, the lower id.
#[derive(Default)]
struct Nearest {
    count: usize,
    /// Square of the distance and id, as one number in the same order.
    keys: [u64; WASTE_MOST],
    offsets: [Vec2; WASTE_MOST],
}

impl Nearest {
    fn take(&mut self, item: ItemId, offset: Vec2) {
        // Bits of numbers that are not negative are in the order of the numbers.
        let squared = offset.length_squared().to_bits();
        let key = u64::from(squared) << 32 | u64::from(item.0);
        let mut place = self.count;
        if place == WASTE_MOST {
            place -= 1;
            if key > self.keys[place] {
                return;
            }
        } else {
            self.count += 1;
        }
        // They are few: from the end on, each that is farther makes room.
        while place > 0 && self.keys[place - 1] > key {
            self.keys[place] = self.keys[place - 1];
            self.offsets[place] = self.offsets[place - 1];
            place -= 1;
        }
        self.keys[place] = key;
        self.offsets[place] = offset;
    }

    fn offsets(&self) -> &[Vec2] {
        &self.offsets[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against sorting them all.
        #[test]
        fn the_nearest_come_first(places in prop::collection::vec((-3..4_i8, -3..4_i8), 0..40)) {
            let mut nearest = Nearest::default();
            let mut all = Vec::new();
            for (id, (x, y)) in (0..).zip(&places) {
                let offset = Vec2::new(f32::from(*x), f32::from(*y)) / 3.0;
                nearest.take(ItemId(id), offset);
                all.push((offset.length_squared(), id, offset));
            }
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let expected: Vec<Vec2> = all.iter().take(WASTE_MOST).map(|it| it.2).collect();
            prop_assert_eq!(nearest.offsets(), expected);
        }
    }
}
