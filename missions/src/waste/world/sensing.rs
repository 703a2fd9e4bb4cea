//! What the devices of the clean-up tell (DESIGN §7).

use alliance_proto::ids::{ItemId, RobotId};
use alliance_proto::mission::items::{ITEMS_MOST, ItemsSensed, SensedItems, Zone};
use glam::Vec2;

use super::Waste;
use world_server::world::{Circle, Floor};

/// A search for zones looks this much farther than a step needs, m.
const ZONE_SKIRT_M: f32 = 2.0;

/// The same for waste, which lies close together: to look farther takes longer than to look more often.
const WASTE_SKIRT_M: f32 = 0.3;

impl Waste {
    pub(super) fn look(&self, robot: RobotId, floor: &Floor, sensed: &mut ItemsSensed) {
        let known = &self.robots[robot.index()];
        if known.jumps.replace(floor.jumps(robot)) != floor.jumps(robot) {
            known.zone.take();
            known.wasteless.take();
        }
        let position = floor.pose(robot).position;
        self.waste_near(robot, floor, sensed.items.insert(SensedItems::new()));
        sensed.zone = Some(self.zone(robot, position));
        sensed.at_site = Some(self.floor.is_report_site(position));
        sensed.holding = Some(known.carrying.is_some());
    }

    /// What is under a robot's center.
    fn zone(&self, robot: RobotId, position: Vec2) -> Zone {
        let known = &self.robots[robot.index()].zone;
        let (circle, zone) = known.get();
        if circle.contains(position) {
            return zone;
        }
        let (zone, edge_m) = self.floor.zone_within(position, ZONE_SKIRT_M);
        known.set((Circle::new(position, edge_m), zone));
        zone
    }

    /// How far from a robot's center its waste sensor reaches, m.
    fn reach_m(floor: &Floor) -> f32 {
        floor.body().radius_m + floor.sensors().item_range_m
    }

    /// The nearest items on the floor within range, nearest first, in the robot's frame.
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

    /// An item lies there no more.
    pub(super) fn taken(&self, from: Vec2, floor: &Floor) {
        floor.changed_near(from, Self::reach_m(floor));
    }

    /// An item lies there now: who knew of no waste in range may sense it.
    pub(super) fn laid(&self, at: Vec2, floor: &Floor) {
        let reach_m = Self::reach_m(floor);
        floor.changed_near(at, reach_m);
        // A circle reaches as far as that, and its robot is in it.
        for (robot, _) in floor.bodies_near(at, reach_m + 2.0 * WASTE_SKIRT_M) {
            self.robots[robot.index()].wasteless.take();
        }
    }
}

/// The nearest of some items, nearest first; of two at the same distance, the lower id.
#[derive(Default)]
struct Nearest {
    count: usize,
    /// Square of the distance and id, as one number in the same order.
    keys: [u64; ITEMS_MOST],
    offsets: [Vec2; ITEMS_MOST],
}

impl Nearest {
    fn take(&mut self, item: ItemId, offset: Vec2) {
        // Bits of numbers that are not negative are in the order of the numbers.
        let squared = offset.length_squared().to_bits();
        let key = u64::from(squared) << 32 | u64::from(item.0);
        let mut place = self.count;
        if place == ITEMS_MOST {
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
            let expected: Vec<Vec2> = all.iter().take(ITEMS_MOST).map(|it| it.2).collect();
            prop_assert_eq!(nearest.offsets(), expected);
        }
    }
}
