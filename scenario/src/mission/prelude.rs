//! The types in the signatures of [`MissionData`].

pub use glam::Vec2;

pub use super::columns::Column;
pub use super::data::{
    BehaviorProperties, BuiltinScenario, DefaultAllianceParams, DrawSection, MissionData,
    MissionVocabulary, Objective, TaskDependencies, WorkUnit, one_behavior_each,
};
pub use super::registry::{Mission, read_section};
pub use super::section::Section;
pub use crate::fault::{FaultArgument, FaultRange, FaultSpec};
pub use crate::{
    BehaviorSpec, Body, KeyPath, ParameterDefault, ParameterRange, ParameterSpec, Problem, Robot,
    Scenario, UntypedTable, limits,
};
