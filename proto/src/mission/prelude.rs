//! What the signatures of a mission's data are written with.

pub use glam::Vec2;

pub use super::columns::Column;
pub use super::data::{BuiltIn, BuiltinScenario, Mission, MissionData, Terms, one_behavior_each};
pub use super::section::{Section, section};
pub use crate::fault::{FaultArgument, FaultRange, FaultSpec};
pub use crate::scenario::{
    BehaviorSpec, Body, ParameterDefault, ParameterRange, ParameterSpec, Path, Problem, Robot,
    Scenario, Unread, limits,
};
