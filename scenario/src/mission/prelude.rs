//! The types in the signatures of [`MissionData`].

pub use glam::Vec2;

pub use super::columns::Column;
pub use super::data::{BuiltIn, BuiltinScenario, Draw, MissionData, Terms, one_behavior_each};
pub use super::registry::{Mission, section};
pub use super::section::Section;
pub use crate::fault::{FaultArgument, FaultRange, FaultSpec};
pub use crate::{
    BehaviorSpec, Body, ParameterDefault, ParameterRange, ParameterSpec, Path, Problem, Robot,
    Scenario, Unread, limits,
};
