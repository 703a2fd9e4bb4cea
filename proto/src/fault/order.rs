//! A fault with its trigger and its duration.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Campaign, Fault, When};
use crate::time::SimTime;

/// "Let this happen then, for so long." Without a trigger it happens at once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// Name, by which it can be cleared; absent: the world gives it one.
    #[serde(default)]
    pub id: Option<String>,
    /// What happens.
    pub fault: Fault,
    /// At this simulated time, s; one that has passed is now.
    #[serde(default)]
    pub at_s: Option<f64>,
    /// Again and again, this long after the time before, s; the first time at `at_s`, or at once.
    #[serde(default)]
    pub every_s: Option<f64>,
    /// When this happens next.
    #[serde(default)]
    pub when: Option<When>,
    /// How long it lasts, s; absent: until it is cleared. What happens in a moment, such as a restart, has no duration.
    #[serde(default)]
    pub for_s: Option<f64>,
}

impl Order {
    /// A fault that happens at once and lasts until it is cleared.
    #[must_use]
    pub fn now(fault: Fault) -> Self {
        Self {
            id: None,
            fault,
            at_s: None,
            every_s: None,
            when: None,
            for_s: None,
        }
    }

    /// Simulated time at which it is due, if time triggers it.
    #[must_use]
    pub fn at(&self) -> Option<SimTime> {
        self.at_s.map(SimTime::from_secs_f64)
    }

    /// How long it lasts.
    #[must_use]
    pub fn duration(&self) -> Option<SimTime> {
        self.for_s.map(SimTime::from_secs_f64)
    }
}

/// The scenario's `[faults]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Faults {
    /// Faults on a schedule.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub timeline: Vec<Order>,
    /// Random faults beside them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub random: Option<Campaign>,
}

impl Faults {
    /// Whether there are none at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.timeline.is_empty() && self.random.is_none()
    }
}
