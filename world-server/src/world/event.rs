//! What happens in a step that the log should say.

use alliance_proto::ids::{ItemId, RobotId};
use glam::Vec2;

/// An event of the world. Each letting go of an item is either [`WorldEvent::Dropped`] or [`WorldEvent::Delivered`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WorldEvent {
    /// The robot took the item up.
    Picked {
        /// Who.
        robot: RobotId,
        /// What.
        item: ItemId,
    },
    /// The empty gripper closed, and nothing was in reach.
    PickFailed {
        /// Who.
        robot: RobotId,
    },
    /// The robot let go of the item outside the deposit.
    Dropped {
        /// Who.
        robot: RobotId,
        /// What.
        item: ItemId,
        /// Where it lies now, m.
        at: Vec2,
    },
    /// The robot let go of the item, and it lies in the deposit.
    Delivered {
        /// Who.
        robot: RobotId,
        /// What.
        item: ItemId,
    },
    /// The robot reported the mission's progress on the report site.
    ReportMade {
        /// Who.
        robot: RobotId,
    },
    /// The robot's energy has run out: from now on its commands have no effect.
    EnergyOut {
        /// Who.
        robot: RobotId,
    },
}
