//! Types in the signatures of a mission's world side.

pub use glam::Vec2;
pub use proto::tick::Outcome;
pub use proto::view::{ItemView, Mark, MarkOutline, MarkRole, View, Work};
pub use scenario::fault::{Fault, MissionFault};
pub use scenario::ids::{ItemId, RobotId};
pub use scenario::time::SimTime;
pub use scenario::{Scenario, Setup};

pub use super::{FigureValue, MissionWorld, StepEvents, TeamFigures, TypedMission, Validity};
pub use crate::world::{Bar, ChangeError, Floor, Push};
