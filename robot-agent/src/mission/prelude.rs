//! The types in the signatures of a mission's controller.

pub use glam::Vec2;
pub use proto::readings::{Actuation, Readings};
pub use proto::telemetry::Note;
pub use scenario::Setup;
pub use scenario::ids::{BehaviorId, RobotId, TaskId};
pub use scenario::time::SimTime;

pub use super::{
    ControllerAdapter, MissionController, Perception, ReceivedBroadcast, SharedMission, StepOutput,
    TypedController, TypedStepInput, bulletin,
};
pub use crate::allocator::{Choice, OwnBehavior};
pub use crate::body::{Chassis, Driver, Goal, Navigator, Surroundings};
