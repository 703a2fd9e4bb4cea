//! The types in the signatures of a mission's controller.

pub use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
pub use alliance_proto::readings::{Actuation, Readings};
pub use alliance_proto::scenario::Setup;
pub use alliance_proto::telemetry::Note;
pub use alliance_proto::time::SimTime;
pub use glam::Vec2;

pub use super::{
    Action, Heard, MissionMind, Perception, SharedMission, Typed, TypedMind, TypedMoment, bulletin,
};
pub use crate::allocator::{Choice, OwnBehavior};
pub use crate::body::{Chassis, Driver, Goal, Navigator, Surroundings};
