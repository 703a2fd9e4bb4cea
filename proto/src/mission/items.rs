//! What robots that find, fetch and carry items sense, do and tell each other: from places called sources to one called target.
//!
//! Missions may have messages of their own, which the frame does not read ([`Payload::Open`](super::Payload::Open)); these are typed for speed, since they
//! are exchanged in every tick. First those of the thesis' case study (§4.1.1).

use arrayvec::ArrayVec;
use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::Deed;
use crate::ids::RobotId;
use crate::time::SimTime;

/// What the zone sensor finds under the robot's center.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Zone {
    /// Plain floor.
    #[default]
    None,
    /// Where items are at first.
    Source,
    /// Where items are to be.
    Target,
}

/// Most items that the item sensor tells apart: with so many, what lies beyond the last is unseen.
pub const ITEMS_MOST: usize = 8;

/// Items on the floor, nearest first, as offsets in the robot's frame, m.
pub type SensedItems = ArrayVec<Vec2, ITEMS_MOST>;

/// What the devices for items tell. Each is `None` when the robot lacks it or when it is dead.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ItemsSensed {
    /// Items on the floor within range, nearest first, as offsets in the robot's frame, m.
    pub items: Option<SensedItems>,
    /// Zone sensor.
    pub zone: Option<Zone>,
    /// Whether the robot's center is where progress is reported.
    pub at_site: Option<bool>,
    /// Whether the gripper holds an item.
    pub holding: Option<bool>,
}

impl ItemsSensed {
    /// All devices are dead.
    pub const NOTHING: Self = Self {
        items: None,
        zone: None,
        at_site: None,
        holding: None,
    };
}

/// What the gripper is told to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Gripper {
    /// Keep whatever it holds or does not hold.
    #[default]
    Keep,
    /// Close on the nearest item in reach.
    Pick,
    /// Let go: the item falls in front of the robot.
    Drop,
}

/// What a robot with a gripper does beside driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ItemsDeed {
    /// Gripper command.
    pub gripper: Gripper,
    /// Report the mission's progress; has an effect there only.
    pub report: bool,
}

/// Doing nothing is no deed, whoever says so.
impl From<ItemsDeed> for Deed {
    #[inline]
    fn from(deed: ItemsDeed) -> Self {
        if deed == ItemsDeed::default() {
            Self::Nothing
        } else {
            Self::Items(deed)
        }
    }
}

impl From<Gripper> for Deed {
    #[inline]
    fn from(gripper: Gripper) -> Self {
        ItemsDeed {
            gripper,
            ..ItemsDeed::default()
        }
        .into()
    }
}

/// Something somebody saw. The newest wins; own sight beats hearsay (DESIGN §7).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact<T> {
    /// What was seen.
    pub value: T,
    /// Who saw it.
    pub seen_by: RobotId,
    /// When.
    pub seen: SimTime,
}

/// Where things are, as computed from the border's extremes (thesis §4.1.1.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Locations {
    /// Smallest x and y of the border, m.
    pub min: Vec2,
    /// Largest x and y of the border, m.
    pub max: Vec2,
}

/// Takes back the [`Locations`] that `finder` broadcast as seen at `seen`, and its older ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Withdrawal {
    /// Whose update is withdrawn.
    pub finder: RobotId,
    /// The time of that update.
    pub seen: SimTime,
}

/// An item lying, or no longer lying, outside the sources.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LooseItem {
    /// Where, m.
    pub at: Vec2,
    /// Whether something lies there; `false` once a robot has looked and found nothing.
    pub present: bool,
}

/// A robot's knowledge about a mission with items, repeated in every heartbeat, so that lost messages, added items and
/// newcomers are no special case (DESIGN §7).
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Knowledge {
    /// The locations, once found.
    pub locations: Option<Fact<Locations>>,
    /// Latest withdrawal known of each finder, by rank of the finder.
    pub withdrawn: Vec<Withdrawal>,
    /// By source, by its place in the scenario and in that order, as far as known: `true` = seen empty, `false` = items seen
    /// there.
    pub empty: Vec<(u16, Fact<bool>)>,
    /// Places outside the sources with items, or searched since.
    pub loose: Vec<Fact<LooseItem>>,
    /// Latest progress report known.
    pub last_report: Option<Fact<()>>,
}

/// By hand: `clone_from` reuses the buffers of the old value, so a heartbeat does not allocate.
impl Clone for Knowledge {
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

/// What robots of the mission tell at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ItemsBulletin {
    /// "I have found the locations" (thesis §4.2.3). Of the first kind, about the task that found them.
    PositionUpdate(Fact<Locations>),
    /// "These locations are wrong": takes back the update of that finder and time. Of the second kind, about no task.
    Withdrawal(Withdrawal),
}
