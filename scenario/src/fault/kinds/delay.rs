//! The fault `delay`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::LinkEnd;
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "delay",
        about: "Delay the messages of a link",
        arguments: &[
            FaultArgument::FROM,
            FaultArgument::TO,
            FaultArgument::at("delay_s", "Delay of every message", FaultRange::Time).option("by"),
            FaultArgument::at(
                "jitter_s",
                "Maximum additional random delay",
                FaultRange::Time,
            )
            .option("jitter")
            .default(0.0),
        ],
    },
    group: FaultGroup::Radio,
    takes_role: false,
    examples: &[(
        r#"{"delay": {"delay_s": 0.5, "jitter_s": 1.5}}"#,
        "messages arrive late by `delay_s`, plus a random time of up to `jitter_s` (default 0)",
    )],
    commands: &[("delay --by 0.5s --jitter 0.2s", "0.5 to 0.7 s")],
    ..FaultKind::OF_ROBOT
};

/// Delay of messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Delay {
    #[serde(default)]
    pub from: LinkEnd,
    #[serde(default)]
    pub to: LinkEnd,
    /// The delay of every message, s.
    pub delay_s: f64,
    /// The maximum additional delay, uniformly distributed, s.
    #[serde(default)]
    pub jitter_s: f64,
}

impl Target for Delay {}
