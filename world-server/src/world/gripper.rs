//! The gripper: takes up the nearest item, puts it down in front of the robot.

use alliance_proto::ids::{ItemId, RobotId};
use alliance_proto::readings::Gripper;
use glam::Vec2;

use super::space::around;
use super::{SKIN_M, World, WorldEvent};

impl World {
    /// Lets go of what a robot carries, as when its agent has died: the item falls where [`Gripper::Drop`] puts it.
    pub fn drop_carried(&mut self, robot: RobotId) -> Option<WorldEvent> {
        let item = self.robots[robot.index()].carrying.take()?;
        let at = self.drop_place(robot);
        let delivered = self.waste.put_down(item, at);
        self.robots[robot.index()].vicinity.unchanged.set(false);
        self.laid(at);
        Some(if delivered {
            WorldEvent::Delivered { robot, item }
        } else {
            WorldEvent::Dropped { robot, item, at }
        })
    }

    pub(super) fn grip(&mut self, robot: RobotId, command: Gripper) -> Option<WorldEvent> {
        match command {
            Gripper::Keep => None,
            Gripper::Drop => self.drop_carried(robot),
            Gripper::Pick if self.robots[robot.index()].carrying.is_some() => None,
            Gripper::Pick => Some(match self.item_in_reach(robot) {
                Some(item) => {
                    let from = self.waste.items()[item.0 as usize].position();
                    self.waste.pick_up(item, robot);
                    self.robots[robot.index()].carrying = Some(item);
                    self.robots[robot.index()].vicinity.unchanged.set(false);
                    self.taken(from);
                    WorldEvent::Picked { robot, item }
                }
                None => WorldEvent::PickFailed { robot },
            }),
        }
    }

    /// The nearest item on the floor whose center the gripper reaches; the lower id of two at the same distance. Not one in
    /// the deposit, which keeps what it gets.
    fn item_in_reach(&self, robot: RobotId) -> Option<ItemId> {
        let position = self.robots[robot.index()].position();
        let reach_m = self.body.radius_m + self.body.reach_m;
        let items = self
            .waste
            .near(position, reach_m)
            .filter(|(_, at)| !self.waste.is_deposit(*at));
        let near = items.map(|(item, at)| (at.distance(position), item));
        let near = near.filter(|(distance, _)| *distance <= reach_m);
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, item)| item)
    }

    /// Where an item falls: at the robot's edge, ahead if it can be gripped there by a teammate past all bodies as they stand,
    /// else in the next direction in which it can; where there is none, the same without regard to bodies; and if the robot
    /// is wedged between solids, under its center.
    fn drop_place(&self, robot: RobotId) -> Vec2 {
        let pose = self.pose(robot);
        let item_radius_m = self.waste.item_radius_m;
        let distance_m = self.body.radius_m + item_radius_m + SKIN_M;
        let places =
            || around(pose.heading_rad).map(|direction| pose.position + direction * distance_m);
        let is_clear = |center: Vec2, radius_m: f32| {
            let least_m = self.body.radius_m + radius_m;
            let mut bodies = self.bodies.near(center, least_m);
            bodies.all(|(_, at)| at.distance(center) >= least_m)
        };
        let past_bodies = places().find(|place| {
            is_clear(*place, item_radius_m)
                && self
                    .space
                    .can_be_gripped(*place, item_radius_m, &self.body, |center| {
                        is_clear(center, self.body.radius_m + SKIN_M)
                    })
        });
        past_bodies
            .or_else(|| {
                places().find(|place| {
                    self.space
                        .can_be_gripped(*place, item_radius_m, &self.body, |_| true)
                })
            })
            .unwrap_or(pose.position)
    }
}
