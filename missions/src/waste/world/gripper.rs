//! The gripper: picks up the nearest item and puts it down in front of the robot.

use glam::Vec2;
use proto::mission::items::Gripper;
use scenario::ids::{ItemId, RobotId};

use super::{DELIVERED, DROPPED, PICK_FAILED, PICKED, RESPAWNED, Waste};
use world_server::mission::StepEvents;
use world_server::world::{Floor, SKIN_M, directions_around};

impl Waste {
    /// Drops the item that a robot carries, if any, in front of the robot.
    pub(super) fn drop_carried(
        &mut self,
        robot: RobotId,
        floor: &Floor,
        happened: &mut StepEvents,
    ) {
        let Some(item) = self.robots[robot.index()].carrying.take() else {
            return;
        };
        let at = self.drop_place(robot, floor);
        let picked_up = self.floor.items()[item.0 as usize].position;
        let delivered = self.floor.put_down(item, at);
        floor.invalidate_readings(robot);
        self.item_added(at, floor);
        let event = if delivered {
            self.robots[robot.index()].delivered += 1;
            happened.push_mission_event(DELIVERED, Some(robot))
        } else {
            let event = happened.push_mission_event(DROPPED, Some(robot));
            event.detail = format!("{} {}", at.x, at.y);
            event
        };
        event.subject = item.to_string();
        if delivered && let Some(back) = self.floor.respawn(item, picked_up, floor) {
            self.item_removed(at, floor);
            self.item_added(back, floor);
            let event = happened.push_mission_event(RESPAWNED, Some(robot));
            event.subject = item.to_string();
            event.detail = format!("{} {}", back.x, back.y);
        }
    }

    pub(super) fn apply_gripper(
        &mut self,
        robot: RobotId,
        command: Gripper,
        floor: &Floor,
        happened: &mut StepEvents,
    ) {
        match command {
            Gripper::Keep => {}
            Gripper::Drop => self.drop_carried(robot, floor, happened),
            Gripper::Pick if self.robots[robot.index()].carrying.is_some() => {}
            Gripper::Pick => match self.item_in_reach(robot, floor) {
                Some(item) => {
                    let from = self.floor.items()[item.0 as usize].position;
                    self.floor.pick_up(item, robot);
                    self.robots[robot.index()].carrying = Some(item);
                    floor.invalidate_readings(robot);
                    self.item_removed(from, floor);
                    happened.push_mission_event(PICKED, Some(robot)).subject = item.to_string();
                }
                None => {
                    happened.push_mission_event(PICK_FAILED, Some(robot));
                }
            },
        }
    }

    /// Returns the nearest item on the floor within reach of the gripper, the lower id at equal distance. Items in a
    /// deposit are excluded: they stay there.
    fn item_in_reach(&self, robot: RobotId, floor: &Floor) -> Option<ItemId> {
        let position = floor.pose(robot).position;
        let reach_m = floor.body().radius_m + floor.body().reach_m;
        let items = self
            .floor
            .near(position, reach_m)
            .filter(|(_, at)| !self.floor.is_deposit(*at));
        let near = items.map(|(item, at)| (at.distance(position), item));
        let near = near.filter(|(distance, _)| *distance <= reach_m);
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, item)| item)
    }

    /// Returns the place where an item falls, at the edge of the robot. Tries 16 directions, starting ahead, and takes
    /// the first place at which a teammate can grip the item. The first pass respects all bodies, the second ignores
    /// them. If both fail, the item falls under the robot's center.
    fn drop_place(&self, robot: RobotId, floor: &Floor) -> Vec2 {
        let pose = floor.pose(robot);
        let body_radius_m = floor.body().radius_m;
        let item_radius_m = self.floor.item_radius_m;
        let distance_m = body_radius_m + item_radius_m + SKIN_M;
        let places = || {
            directions_around(pose.heading_rad)
                .map(|direction| pose.position + direction * distance_m)
        };
        let is_clear = |center: Vec2, radius_m: f32| {
            let least_m = body_radius_m + radius_m;
            let mut bodies = floor.bodies_near(center, least_m);
            bodies.all(|(_, at)| at.distance(center) >= least_m)
        };
        let past_bodies = places().find(|place| {
            is_clear(*place, item_radius_m)
                && floor.can_be_gripped(*place, item_radius_m, |center| {
                    is_clear(center, body_radius_m + SKIN_M)
                })
        });
        past_bodies
            .or_else(|| {
                places().find(|place| floor.can_be_gripped(*place, item_radius_m, |_| true))
            })
            .unwrap_or(pose.position)
    }
}
