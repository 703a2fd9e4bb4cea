//! Faults, with the same vocabulary for the control topic, the scenario's timeline, the command line and the page.
//!
//! - `Fault`: a failure and its target. `Order`: a fault with its id, trigger and duration. `When`: an event as a
//!   trigger.
//! - [`RadioQuality`]: named sets of link faults. [`RandomFaults`]: random faults with mean times between failure and
//!   repair.
//!
//! `kinds` declares each fault in a file of its own. The text form, the command line, the checks of ranges, the page,
//! the JSON Schema and the tables of `docs/CONTROL.md` follow from these declarations.
//!
//! Every form uses the same definition. In JSON and TOML a fault is a table with the fault's name as its only key:
//! `{"kill": "gold"}`, `fault.drop = { from = "green", to = "all", p = 0.3 }`. The text form matches the command line:
//! `drop --from green --to all --p 0.3`.

mod campaign;
mod check;
mod checker;
mod device;
mod form;
mod kinds;
mod mission;
mod modes;
mod order;
mod spec;
#[cfg(test)]
mod tests;
mod text;
mod when;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::names::ALL;

pub use campaign::{FaultMix, RandomFaults};
pub use device::Device;
pub use kinds::*;
pub use mission::{FaultValue, MissionFault};
pub use order::{Faults, Order};
pub use spec::{
    ArgumentForm, FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec, Mode, ModeForm,
    ModeSize, ValueKind,
};
pub use text::Role;
pub use when::{EventTrigger, TriggerEvent, WhenError};

/// An end of a link: a robot by its name, or `all`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "String", into = "String")]
#[schemars(with = "String")]
pub enum LinkEnd {
    /// Every robot of the team.
    #[default]
    All,
    /// The robot with this name.
    Robot(String),
}

impl LinkEnd {
    #[must_use]
    pub fn includes(&self, robot: &str) -> bool {
        match self {
            Self::All => true,
            Self::Robot(name) => name == robot,
        }
    }

    /// Returns `all` or the robot's name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => ALL,
            Self::Robot(name) => name,
        }
    }
}

impl From<String> for LinkEnd {
    fn from(name: String) -> Self {
        if name == ALL {
            Self::All
        } else {
            Self::Robot(name)
        }
    }
}

impl From<LinkEnd> for String {
    fn from(who: LinkEnd) -> Self {
        who.as_str().to_owned()
    }
}

/// Directed links from senders to receivers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LinkSelection {
    pub from: LinkEnd,
    pub to: LinkEnd,
}

/// A random effect on messages of directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkChance {
    #[serde(default)]
    pub from: LinkEnd,
    #[serde(default)]
    pub to: LinkEnd,
    /// The share of affected messages, 0 to 1.
    pub p: f64,
}

impl LinkChance {
    /// The arguments of a fault with this effect.
    const ARGUMENTS: &[FaultArgument] = &[
        FaultArgument::FROM,
        FaultArgument::TO,
        FaultArgument::at(
            "p",
            "Share of messages that are affected, 0 to 1",
            FaultRange::SHARE,
        )
        .option("p"),
    ];
}
