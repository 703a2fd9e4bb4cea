//! Types in the signatures of a mission's world side.

pub use glam::Vec2;
pub use proto::mission::{Action, SensorReading};
pub use proto::tick::Outcome;
pub use proto::view::{ItemView, Mark, MarkOutline, MarkRole, View, Work};
pub use scenario::fault::MissionFault;
pub use scenario::ids::{ItemId, RobotId};
pub use scenario::time::SimTime;
pub use scenario::{Problem, Scenario, Setup};

pub use super::{
    FigureValue, MissionWorld, StepEvents, TeamFigures, Validity, WorldKind, hash_state,
};
pub use crate::world::{Bar, ChangeError, Floor, Places, Push};
