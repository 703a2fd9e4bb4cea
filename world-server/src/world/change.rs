//! How the world is changed from outside between two steps: by interruption handlers (thesis §3.2.2.2) and by faults.
//!
//! Whatever is done, bodies overlap nothing that they did not overlap before, but for an obstacle that is put on them; and
//! items are neither lost nor doubled.

use alliance_proto::ids::{ItemId, RobotId};
use alliance_proto::readings::Pose;
use alliance_proto::scenario::Obstacle;
use glam::Vec2;

use super::motion::wrapped;
use super::space::nearest_place;
use super::start::ROUNDING_M;
use super::vicinity::Vicinity;
use super::{ObstacleId, World, WorldEvent};

/// Why the world cannot be changed like that.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChangeError {
    /// No item has that number.
    #[error("there is no {0}")]
    NoItem(ItemId),
    /// A robot carries the item.
    #[error("{0} is being carried")]
    Carried(ItemId),
    /// The deposit keeps what it gets.
    #[error("{0} is in the deposit")]
    Delivered(ItemId),
    /// An item could lie nowhere.
    #[error("no place is left where a robot could grip an item")]
    NoPlaceForItem,
    /// The body does not fit there.
    #[error("the place is outside the border, on a solid obstacle or on another robot")]
    Taken,
    /// The body fits nowhere.
    #[error("no room is left for the robot")]
    NoRoom,
    /// The robot has no body.
    #[error("the robot is not in the mission")]
    Absent,
    /// The robot has a body already.
    #[error("the robot is in the mission already")]
    Present,
}

impl World {
    /// Puts a rectangle on the floor: an obstacle, or a patch that slows down or speeds up. It may lie anywhere; a robot
    /// that it covers is not moved, but can only leave it.
    pub fn add_obstacle(&mut self, obstacle: &Obstacle) -> ObstacleId {
        self.floor_changed();
        self.space.add(obstacle)
    }

    /// Takes a rectangle away. Its id is not given again. Says whether it was there.
    pub fn remove_obstacle(&mut self, obstacle: ObstacleId) -> bool {
        self.floor_changed();
        self.space.remove(obstacle)
    }

    /// Anybody may sense something else now.
    fn floor_changed(&self) {
        for robot in &self.robots {
            robot.vicinity.unchanged.set(false);
        }
    }

    /// Puts a new item on the floor, at the nearest place to that one at which a robot can grip it and, if there is room, no
    /// other item lies. The mission is complete only when it has been delivered too.
    ///
    /// # Errors
    /// [`ChangeError::NoPlaceForItem`].
    pub fn add_item(&mut self, near: Vec2) -> Result<ItemId, ChangeError> {
        let place = self.place_for_item(near, None)?;
        let item = self.waste.add(place);
        self.laid(place);
        Ok(item)
    }

    /// Puts an item that lies on the floor elsewhere, placed like a new one. Tells where it lies now, m.
    ///
    /// # Errors
    /// When there is no such item, when it is carried or delivered, and when it could lie nowhere.
    pub fn move_item(&mut self, item: ItemId, near: Vec2) -> Result<Vec2, ChangeError> {
        let found = self.waste.items().get(item.0 as usize);
        let found = found.ok_or(ChangeError::NoItem(item))?;
        if found.carrier.is_some() {
            return Err(ChangeError::Carried(item));
        }
        if self.waste.is_deposit(found.position()) {
            return Err(ChangeError::Delivered(item));
        }
        let from = found.position();
        let place = self.place_for_item(near, Some(item))?;
        self.taken(from);
        self.waste.relocate(item, place);
        self.laid(place);
        Ok(place)
    }

    fn place_for_item(&self, near: Vec2, moved: Option<ItemId>) -> Result<Vec2, ChangeError> {
        let radius_m = self.waste.item_radius_m;
        let will_do = |place| {
            self.space
                .can_be_gripped(place, radius_m, &self.body, |_| true)
        };
        let least_m = 2.0 * radius_m - ROUNDING_M;
        let is_apart = |place: Vec2| {
            let items = self.waste.near(place, least_m);
            let mut others = items.filter(|(item, _)| Some(*item) != moved);
            others.all(|(_, at)| at.distance(place) >= least_m)
        };
        nearest_place(near, self.space.size, |place| {
            is_apart(place) && will_do(place)
        })
        .or_else(|| nearest_place(near, self.space.size, will_do))
        .ok_or(ChangeError::NoPlaceForItem)
    }

    /// Puts a robot's body elsewhere, with what it carries. Without a heading it keeps its own.
    ///
    /// # Errors
    /// When the body does not fit there, and when there is none.
    pub fn move_robot(
        &mut self,
        robot: RobotId,
        to: Vec2,
        heading_rad: Option<f32>,
    ) -> Result<(), ChangeError> {
        if !self.is_present(robot) {
            return Err(ChangeError::Absent);
        }
        if !self.is_free(robot, to) {
            return Err(ChangeError::Taken);
        }
        let body = &mut self.robots[robot.index()];
        let from = std::mem::replace(&mut body.component.pose.position, to);
        if let Some(heading_rad) = heading_rad {
            body.face(wrapped(heading_rad));
        }
        self.disturbed(from, 0.0);
        self.jumped(robot, to);
        Ok(())
    }

    /// Gives an absent robot its body: at its start, or at the nearest place to it that is free. Tells where.
    ///
    /// # Errors
    /// When it has one, and when there is no room.
    pub fn add_robot(&mut self, robot: RobotId) -> Result<Pose, ChangeError> {
        if self.is_present(robot) {
            return Err(ChangeError::Present);
        }
        let start = self.robots[robot.index()].start;
        let place = nearest_place(start.position, self.space.size, |place| {
            self.is_free(robot, place)
        });
        let place = place.ok_or(ChangeError::NoRoom)?;
        let body = &mut self.robots[robot.index()];
        body.component.pose.position = place;
        body.face(start.heading_rad);
        body.present = true;
        let pose = body.component.pose;
        self.bodies.insert(robot.index(), place);
        self.jumped(robot, place);
        Ok(pose)
    }

    /// Keeps track of a body that has been put somewhere.
    fn jumped(&mut self, robot: RobotId, to: Vec2) {
        self.robots[robot.index()].vicinity = Vicinity::default();
        self.drift.jumps(self.space.size);
        self.relocated(robot, to);
        self.disturbed(to, 0.0);
    }

    /// Takes a robot's body away: nothing touches or senses it, and it obeys nothing. What it carries falls first, as with
    /// [`World::drop_carried`]. Its battery keeps its charge.
    pub fn remove_robot(&mut self, robot: RobotId) -> Option<WorldEvent> {
        let event = self.drop_carried(robot);
        let body = &mut self.robots[robot.index()];
        body.speed_m_s = 0.0;
        if std::mem::replace(&mut body.present, false) {
            let from = body.position();
            self.bodies.remove(robot.index());
            self.disturbed(from, 0.0);
        }
        event
    }

    /// Switches a robot's power on or off. Without power its body obeys nothing, and nothing is drawn from its battery.
    pub fn set_powered(&mut self, robot: RobotId, powered: bool) {
        self.robots[robot.index()].powered = powered;
    }

    /// Whether a robot's body fits there. It may touch what is solid, but for rounding.
    fn is_free(&self, robot: RobotId, center: Vec2) -> bool {
        let still = self.space.solids_near(center, self.body.radius_m);
        let others = self.solid_teammates(robot, center, self.body.radius_m);
        still
            .chain(others)
            .all(|solid| solid.surface(center).0 >= self.body.radius_m - ROUNDING_M)
    }
}
