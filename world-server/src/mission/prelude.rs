//! Types in the signatures of a mission's world side.

pub use alliance_proto::fault::{Fault, MissionFault};
pub use alliance_proto::ids::{ItemId, RobotId};
pub use alliance_proto::scenario::{Scenario, Setup};
pub use alliance_proto::tick::Outcome;
pub use alliance_proto::time::SimTime;
pub use alliance_proto::view::{ItemView, Mark, MarkOutline, MarkRole, View};
pub use glam::Vec2;

pub use super::{Happened, MissionWorld, TeamFigures, TypedMission, Validity, Value};
pub use crate::world::{Bar, ChangeError, Floor, Push};
