//! Sensor readings of the clean-up's devices.

use glam::Vec2;
use proto::mission::items::{ItemsReading, MAX_SENSED_ITEMS, SensedItems, Zone};
use scenario::ids::{ItemId, RobotId};

use super::Waste;
use world_server::world::{Circle, Floor};

/// The additional search radius for zones, m. A result stays valid while the robot is within it.
const ZONE_SKIRT_M: f32 = 2.0;

/// The additional search radius for waste, m. It is small because items lie close together, so a wide search is slow.
const WASTE_SKIRT_M: f32 = 0.3;

impl Waste {
    pub(super) fn read_devices(&self, robot: RobotId, floor: &Floor, sensed: &mut ItemsReading) {
        let cached = &self.robots[robot.index()];
        if cached.jumps.replace(floor.placement_count(robot)) != floor.placement_count(robot) {
            cached.zone.take();
            cached.wasteless.take();
        }
        let position = floor.pose(robot).position;
        self.waste_near(robot, floor, sensed.items.insert(SensedItems::new()));
        sensed.zone = Some(self.zone(robot, position));
        sensed.at_site = Some(self.floor.is_report_site(position));
        sensed.holding = Some(cached.carrying.is_some());
    }

    fn zone(&self, robot: RobotId, position: Vec2) -> Zone {
        let cached = &self.robots[robot.index()].zone;
        let (circle, zone) = cached.get();
        if circle.contains(position) {
            return zone;
        }
        let (zone, edge_m) = self.floor.zone_within(position, ZONE_SKIRT_M);
        cached.set((Circle::new(position, edge_m), zone));
        zone
    }

    /// Returns the range of the waste sensor from a robot's center, m.
    fn reach_m(floor: &Floor) -> f32 {
        floor.body().radius_m + floor.sensors().item_range_m
    }

    /// Writes the nearest items within range in the robot's frame, nearest first.
    fn waste_near(&self, robot: RobotId, floor: &Floor, sensed: &mut SensedItems) {
        let position = floor.pose(robot).position;
        let wasteless = &self.robots[robot.index()].wasteless;
        if wasteless.get().contains(position) {
            return;
        }
        let reach_m = Self::reach_m(floor);
        let far_m = reach_m + WASTE_SKIRT_M;
        let mut nearest = Nearest::default();
        let mut least = far_m * far_m;
        self.floor.near(position, far_m).for_each(|(item, at)| {
            let offset = at - position;
            let squared = offset.length_squared();
            least = least.min(squared);
            if squared <= reach_m * reach_m {
                nearest.take(item, offset);
            }
        });
        wasteless.set(Circle::new(position, least.sqrt() - reach_m));
        let ahead = floor.ahead(robot);
        let left = ahead.perp();
        let in_frame = |offset: &Vec2| Vec2::new(ahead.dot(*offset), left.dot(*offset));
        sensed.extend(nearest.offsets().iter().map(in_frame));
    }

    /// Invalidates cached readings near a place from which an item was taken.
    pub(super) fn item_removed(&self, from: Vec2, floor: &Floor) {
        floor.invalidate_readings_near(from, Self::reach_m(floor));
    }

    /// Invalidates cached readings near a place where an item now lies.
    pub(super) fn item_added(&self, at: Vec2, floor: &Floor) {
        let reach_m = Self::reach_m(floor);
        floor.invalidate_readings_near(at, reach_m);
        // A circle without waste has at most this radius, and its robot is inside.
        for (robot, _) in floor.bodies_near(at, reach_m + 2.0 * WASTE_SKIRT_M) {
            self.robots[robot.index()].wasteless.take();
        }
    }
}

/// The nearest items, nearest first. At equal distance the lower id comes first.
#[derive(Default)]
struct Nearest {
    count: usize,
    /// Squared distance and id combined into one number that sorts in the same order.
    keys: [u64; MAX_SENSED_ITEMS],
    offsets: [Vec2; MAX_SENSED_ITEMS],
}

impl Nearest {
    fn take(&mut self, item: ItemId, offset: Vec2) {
        // The bits of non-negative floats sort like the numbers.
        let squared = offset.length_squared().to_bits();
        let key = u64::from(squared) << 32 | u64::from(item.0);
        let mut place = self.count;
        if place == MAX_SENSED_ITEMS {
            place -= 1;
            if key > self.keys[place] {
                return;
            }
        } else {
            self.count += 1;
        }
        // The list is short, so insertion from the end is fast.
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
            let expected: Vec<Vec2> = all.iter().take(MAX_SENSED_ITEMS).map(|entry| entry.2).collect();
            prop_assert_eq!(nearest.offsets(), expected);
        }
    }
}
