//! Sensor readings of the clean-up's devices.

use std::sync::atomic::Ordering::Relaxed;

use arrayvec::ArrayVec;
use glam::Vec2;
use proto::mission::items::{ItemsReading, MAX_SENSED_ITEMS, SensedItems, Zone};
use scenario::ids::{ItemId, RobotId};

use super::Waste;
use crate::geometry::nearest;
use world_server::world::{Circle, Floor};

/// The additional search radius for zones, m. A result stays valid while the robot is within it.
const ZONE_SKIRT_M: f32 = 2.0;

/// The zones by their numbers in a cache.
const ZONES: [Zone; 3] = [Zone::None, Zone::Source, Zone::Target];

/// The additional search radius for waste, m. It is small because items lie close together, so a wide search is slow.
const WASTE_SKIRT_M: f32 = 0.3;

impl Waste {
    pub(super) fn read_devices(&self, robot: RobotId, floor: &Floor, sensed: &mut ItemsReading) {
        let cleaner = &self.robots[robot.index()];
        let (caches, jumps) = (&cleaner.caches, floor.placement_count(robot));
        if caches.jumps.load(Relaxed) != jumps {
            caches.jumps.store(jumps, Relaxed);
            caches.zone.clear();
            caches.wasteless.clear();
        }
        let position = floor.pose(robot).position;
        self.waste_near(robot, floor, sensed.items.insert(SensedItems::new()));
        sensed.zone = Some(self.zone(robot, position));
        sensed.at_site = Some(self.floor.is_report_site(position));
        sensed.holding = Some(cleaner.carrying.is_some());
    }

    fn zone(&self, robot: RobotId, position: Vec2) -> Zone {
        let cached = &self.robots[robot.index()].caches.zone;
        let (circle, number) = cached.get();
        if circle.contains(position) {
            return ZONES[number as usize];
        }
        let (zone, edge_m) = self.floor.zone_within(position, ZONE_SKIRT_M);
        cached.set(Circle::new(position, edge_m), zone as u32);
        zone
    }

    /// Returns the range of the waste sensor from a robot's center, m.
    fn reach_m(floor: &Floor) -> f32 {
        floor.body().radius_m + floor.sensors().item_range_m
    }

    /// Writes the nearest items within range in the robot's frame, nearest first.
    fn waste_near(&self, robot: RobotId, floor: &Floor, sensed: &mut SensedItems) {
        let position = floor.pose(robot).position;
        let wasteless = &self.robots[robot.index()].caches.wasteless;
        if wasteless.get().0.contains(position) {
            return;
        }
        let reach_m = Self::reach_m(floor);
        let far_m = reach_m + WASTE_SKIRT_M;
        let mut least = far_m * far_m;
        let near = self.floor.near(position, far_m);
        let in_reach = near.filter_map(|(item, at)| {
            let squared = at.distance_squared(position);
            least = least.min(squared);
            (squared <= reach_m * reach_m).then_some((squared, item))
        });
        let nearest: ArrayVec<(f32, ItemId), MAX_SENSED_ITEMS> = nearest(in_reach);
        wasteless.set(Circle::new(position, least.sqrt() - reach_m), 0);
        let ahead = floor.ahead(robot);
        let left = ahead.perp();
        sensed.extend(nearest.iter().map(|(_, item)| {
            let offset = self.floor.items()[item.0 as usize].position - position;
            Vec2::new(ahead.dot(offset), left.dot(offset))
        }));
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
            self.robots[robot.index()].caches.wasteless.clear();
        }
    }
}
