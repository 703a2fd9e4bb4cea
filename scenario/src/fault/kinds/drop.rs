//! The fault `drop`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};
use crate::fault::{Fault, LinkEnd};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "drop",
        about: "Drop a share of messages",
        arguments: &[
            FaultArgument::FROM,
            FaultArgument::TO,
            FaultArgument::at(
                "p",
                "Share of messages that are lost, 0 to 1",
                FaultRange::SHARE,
            )
            .option("p"),
            FaultArgument::at(
                "burst_s",
                "Mean length of a burst of losses; 0 for independent losses",
                FaultRange::Time,
            )
            .option("burst")
            .default(0.0),
        ],
    },
    group: FaultGroup::Radio,
    takes_role: false,
    examples: &[(
        r#"{"drop": {"from": "green", "to": "all", "p": 0.3, "burst_s": 2.0}}"#,
        "messages are lost: with `burst_s` in bursts of this mean length, otherwise independently",
    )],
    commands: &[
        ("drop --p 0.3", "30 % of all messages"),
        ("drop --p 0.5 --burst 2s --to blue", "in bursts"),
    ],
    check,
    ..FaultKind::OF_ROBOT
};

/// Loss of messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Loss {
    #[serde(default)]
    pub from: LinkEnd,
    #[serde(default)]
    pub to: LinkEnd,
    /// The share of messages that get lost in the long run, 0 to 1.
    pub p: f64,
    /// The mean length of a burst in which every message is lost, s; 0 makes losses independent (Gilbert 1960).
    #[serde(default)]
    pub burst_s: f64,
}

impl Target for Loss {}

fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    match fault {
        Fault::Drop(loss) if loss.burst_s > 0.0 => checker.bursts(["fault", "drop", "burst_s"]),
        _ => Ok(()),
    }
}
