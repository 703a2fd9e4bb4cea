//! Identifiers of robots, tasks, behavior sets and items. Messages use ids; key expressions, files and the screen use
//! names.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A robot's rank: its index in the scenario's list of robots, from 0.
///
/// The rank also fixes every order of robots: commands, claims in the same tick, and stepping in order.
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
    /// Returns the rank as an index into a list with one entry per robot.
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

/// A task of the mission: its index in [`crate::Catalog::tasks`].
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
pub struct TaskId(pub u16);

/// A behavior set: its index in [`crate::Catalog::sets`], the same for every robot that has the set.
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
    /// Returns the index into the catalog's tasks.
    #[inline]
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl BehaviorId {
    /// Returns the index into the catalog's behavior sets.
    #[inline]
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// An item that robots can carry, numbered from 0.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
pub struct ItemId(pub u32);

/// Formats the id as in the log: `item-7`.
impl fmt::Display for ItemId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "item-{}", self.0)
    }
}

/// The incarnation of a robot's agent. The world counts from 1; a restarted agent gets the next number.
pub type Incarnation = u32;

/// A step number, from 0. The sensor readings of tick `t` show the world at time `t · step`.
pub type Tick = u64;
