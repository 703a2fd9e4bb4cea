//! Identifiers. On the bus a robot goes by its rank; names appear in key expressions, files and on the screen.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A robot, by its rank: its place in the scenario's list of robots, counted from 0.
///
/// The rank is also its place in every fixed order: of commands, of same-step claims, of in-order stepping (DESIGN §4).
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    JsonSchema,
)]
pub struct RobotId(pub u16);

impl RobotId {
    /// The rank as an index into a list with one entry per robot.
    #[inline]
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl fmt::Display for RobotId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "robot#{}", self.0)
    }
}

/// A high-level task of the mission, by its place in [`crate::scenario::Catalog::tasks`].
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
pub struct TaskId(pub u16);

/// A behavior set, by its place in [`crate::scenario::Catalog::sets`]; the same for every robot that has it.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    JsonSchema,
)]
pub struct BehaviorId(pub u16);

impl TaskId {
    /// Index into the catalog's tasks.
    #[inline]
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl BehaviorId {
    /// Index into the catalog's behavior sets.
    #[inline]
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// An item that robots take, counted from 0.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
pub struct ItemId(pub u32);

/// As the log has it: `item-7`.
impl fmt::Display for ItemId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "item-{}", self.0)
    }
}

/// Incarnation of a robot's agent, counted by the world from 1; a restarted agent gets the next one.
pub type Incarnation = u32;

/// Step number, from 0. The readings of tick `t` show the world at `t · step`.
pub type Tick = u64;
