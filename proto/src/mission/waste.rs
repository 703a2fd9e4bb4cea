//! The waste clean-up on the bus and in the log (thesis §4.1.1).

use arrayvec::ArrayVec;
use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::{Deed, Payload};
use crate::ids::RobotId;
use crate::team::{About, Bulletin, BulletinKind};
use crate::time::SimTime;

/// What the spill sensor finds under the robot's center.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Zone {
    /// Plain floor.
    #[default]
    None,
    /// An initial spill location.
    Spill,
    /// The desired final spill location.
    Deposit,
}

/// Most items that the waste sensor tells apart: with so many, what lies beyond the last is unseen.
pub const WASTE_MOST: usize = 8;

/// Waste on the floor, nearest first, as offsets in the robot's frame, m.
pub type SensedWaste = ArrayVec<Vec2, WASTE_MOST>;

/// What the devices of the clean-up tell. Each is `None` when the robot lacks it or when it is dead.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WasteSensed {
    /// Waste on the floor within range, nearest first, as offsets in the robot's frame, m.
    pub waste: Option<SensedWaste>,
    /// Spill sensor.
    pub zone: Option<Zone>,
    /// Whether the robot's center is on the report site.
    pub report_site: Option<bool>,
    /// Whether the gripper holds an item.
    pub holding: Option<bool>,
}

impl WasteSensed {
    /// All devices are dead.
    pub const NOTHING: Self = Self {
        waste: None,
        zone: None,
        report_site: None,
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

/// What a robot of the clean-up does beside driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WasteDeed {
    /// Gripper command.
    pub gripper: Gripper,
    /// Report the mission's progress; has an effect on the report site only.
    pub report_progress: bool,
}

/// Doing nothing is no deed, whoever says so.
impl From<WasteDeed> for Deed {
    #[inline]
    fn from(deed: WasteDeed) -> Self {
        if deed == WasteDeed::default() {
            Self::Nothing
        } else {
            Self::Waste(deed)
        }
    }
}

impl From<Gripper> for Deed {
    #[inline]
    fn from(gripper: Gripper) -> Self {
        WasteDeed {
            gripper,
            ..WasteDeed::default()
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

/// Waste lying, or no longer lying, outside the spills.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LooseWaste {
    /// Where, m.
    pub at: Vec2,
    /// Whether something lies there; `false` once a robot has looked and found nothing.
    pub present: bool,
}

/// A robot's knowledge about the waste clean-up, repeated in every heartbeat, so that lost messages, added waste and
/// newcomers are no special case (DESIGN §7).
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Knowledge {
    /// The locations, once found.
    pub locations: Option<Fact<Locations>>,
    /// Latest withdrawal known of each finder, by rank of the finder.
    pub withdrawn: Vec<Withdrawal>,
    /// By spill, by its place in the scenario and in that order, as far as known: `true` = seen empty, `false` = waste seen
    /// there.
    pub empty: Vec<(u16, Fact<bool>)>,
    /// Places outside the spills with waste, or searched since.
    pub loose: Vec<Fact<LooseWaste>>,
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

/// What robots of the clean-up tell at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum WasteBulletin {
    /// "I have found the locations" (thesis §4.2.3). Of the first kind, about the task that found them.
    PositionUpdate(Fact<Locations>),
    /// "These locations are wrong": takes back the update of that finder and time. Of the second kind, about no task.
    Withdrawal(Withdrawal),
}

impl WasteBulletin {
    /// As it is broadcast.
    #[must_use]
    pub fn about(self, about: Option<About>) -> Bulletin {
        Bulletin {
            kind: match self {
                Self::PositionUpdate(_) => BulletinKind::First,
                Self::Withdrawal(_) => BulletinKind::Second,
            },
            about,
            payload: Payload::Waste(self),
        }
    }
}
