//! Identifiers of robots, tasks, behavior sets and items. Messages use ids; key expressions, files and the screen use
//! names.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Declares an identifier: a number with an order.
macro_rules! id {
    ($(#[$about:meta])* $name:ident($number:ty)) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[derive(Serialize, Deserialize, JsonSchema)]
        pub struct $name(pub $number);
    };
}

/// Declares an identifier that is an index into a list.
macro_rules! index {
    ($(#[$about:meta])* $name:ident) => {
        id! { $(#[$about])* $name(u32) }

        impl $name {
            /// Returns the index into a list with one entry for each of them.
            #[inline]
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

index! {
    /// A robot's rank: its index in the scenario's list of robots, from 0.
    ///
    /// The rank also fixes every order of robots: commands, claims in the same tick, and stepping in order.
    RobotId
}

index! {
    /// A task of the mission: its index in [`crate::Catalog::tasks`].
    TaskId
}

index! {
    /// A behavior set: its index in [`crate::Catalog::sets`], the same for every robot that has the set.
    BehaviorId
}

id! {
    /// An item that robots can carry, numbered from 0.
    ItemId(u32)
}

impl fmt::Display for RobotId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "robot#{}", self.0)
    }
}

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
