//! Sensor readings, actions and messages of missions in which robots carry items from sources to a target.
//!
//! A mission may define its own messages, which the framework does not read ([`Payload::Open`](super::Payload::Open)).
//! The messages here are typed for speed, because robots exchange them in every tick. They follow the case study of the
//! thesis (§4.1.1).

use arrayvec::ArrayVec;
use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::Action;
use scenario::ids::RobotId;
use scenario::time::SimTime;

/// The area under the robot's center, as the zone sensor reports it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Zone {
    /// Floor outside the special areas.
    #[default]
    None,
    /// The area where items start.
    Source,
    /// The area to which robots bring items.
    Target,
}

/// The maximum number of items in a sensor reading. A full reading omits the items beyond the last one.
pub const MAX_SENSED_ITEMS: usize = 8;

/// Offsets of items on the floor in the robot's frame, nearest first, m.
pub type SensedItems = ArrayVec<Vec2, MAX_SENSED_ITEMS>;

/// The readings of the devices for items. A reading is `None` if the robot lacks the device or the device is dead.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ItemsReading {
    /// The items on the floor within range.
    pub items: Option<SensedItems>,
    /// The reading of the zone sensor.
    pub zone: Option<Zone>,
    /// True if the robot's center is at the place for progress reports.
    pub at_site: Option<bool>,
    /// True if the gripper holds an item.
    pub holding: Option<bool>,
}

impl ItemsReading {
    /// The readings if all devices are dead.
    pub const NOTHING: Self = Self {
        items: None,
        zone: None,
        at_site: None,
        holding: None,
    };
}

/// A command to the gripper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Gripper {
    /// No change of the gripper.
    #[default]
    Keep,
    /// Close on the nearest item in reach.
    Pick,
    /// Open: the item falls in front of the robot.
    Drop,
}

/// The actions of a robot with a gripper besides driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ItemsAction {
    /// The command to the gripper.
    pub gripper: Gripper,
    /// True to report the mission's progress, which has an effect only at the place for reports.
    pub report: bool,
}

/// Converts the default action to `Deed::Nothing`, so that doing nothing has a single form.
impl From<ItemsAction> for Action {
    #[inline]
    fn from(action: ItemsAction) -> Self {
        if action == ItemsAction::default() {
            Self::Nothing
        } else {
            Self::Items(action)
        }
    }
}

impl From<Gripper> for Action {
    #[inline]
    fn from(gripper: Gripper) -> Self {
        ItemsAction {
            gripper,
            ..ItemsAction::default()
        }
        .into()
    }
}

/// An observation of a robot. The newest one has priority; a robot's own observation has priority over a received one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact<T> {
    /// The value that was observed.
    pub value: T,
    /// The robot that made the observation.
    pub seen_by: RobotId,
    /// The time of the observation.
    pub seen: SimTime,
}

/// The extremes of the border, from which robots compute all places (thesis §4.1.1.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Locations {
    /// The smallest x and y of the border, m.
    pub min: Vec2,
    /// The largest x and y of the border, m.
    pub max: Vec2,
}

/// The withdrawal of the [`Locations`] that `finder` broadcast as seen at `seen`, and of its older ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Withdrawal {
    /// The robot whose update is withdrawn.
    pub finder: RobotId,
    /// The time of that update.
    pub seen: SimTime,
}

/// A place outside the sources where an item lies or no longer lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LooseItem {
    /// The position of the item, m.
    pub at: Vec2,
    /// True if an item lies there; false after a robot has searched in vain.
    pub present: bool,
}

/// A robot's knowledge about a mission with items, repeated in every heartbeat.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ItemsKnowledge {
    /// The locations, once a robot has found them.
    pub locations: Option<Fact<Locations>>,
    /// The latest known withdrawal of each finder, by rank of the finder.
    pub withdrawn: Vec<Withdrawal>,
    /// The known state of sources, by index in the scenario and in that order. True means seen empty; false means items
    /// were seen there.
    pub empty: Vec<(u32, Fact<bool>)>,
    /// The places outside the sources with items, or searched since.
    pub loose: Vec<Fact<LooseItem>>,
    /// The latest known progress report.
    pub last_report: Option<Fact<()>>,
}

/// Implements `clone_from` by hand to reuse the buffers of the old value, so a heartbeat does not allocate.
impl Clone for ItemsKnowledge {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, source: &Self) {
        let Self {
            locations,
            withdrawn,
            empty,
            loose,
            last_report,
        } = source;
        self.locations = *locations;
        self.withdrawn.clone_from(withdrawn);
        self.empty.clone_from(empty);
        self.loose.clone_from(loose);
        self.last_report = *last_report;
    }
}

/// The messages that robots of the mission broadcast at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ItemsBulletin {
    /// Newly found locations (thesis §4.2.3). A bulletin of the first kind, about the task that found them.
    PositionUpdate(Fact<Locations>),
    /// A withdrawal of wrong locations, by finder and time. A bulletin of the second kind, about no task.
    Withdrawal(Withdrawal),
}
