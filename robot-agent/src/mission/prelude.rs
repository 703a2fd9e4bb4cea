//! The types in the signatures of a mission's controller.

pub use std::sync::Arc;

pub use glam::Vec2;
pub use proto::mission::{Action, Payload, SharedKnowledge};
pub use proto::readings::{Actuation, Readings};
pub use proto::team::{Broadcast, Bulletin, BulletinKind, BulletinSubject};
pub use proto::telemetry::Note;
pub use scenario::Setup;
pub use scenario::ids::{BehaviorId, RobotId, TaskId};
pub use scenario::time::SimTime;

pub use super::{
    ControllerConstructor, ControllerInput, ControllerKind, MissionController, Perception,
    StepOutput,
};
pub use crate::allocator::{Choice, OwnBehavior};
pub use crate::body::{Chassis, Driver, Goal, Navigator, Surroundings};
