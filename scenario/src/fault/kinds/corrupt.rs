//! The fault `corrupt`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::LinkEnd;
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "corrupt",
        about: "Flip bits of messages",
        arguments: &[
            FaultArgument::FROM,
            FaultArgument::TO,
            FaultArgument::at(
                "p",
                "Probability that a bit of the payload flips, 0 to 1",
                FaultRange::SHARE,
            )
            .option("p"),
            FaultArgument::at(
                "checksum",
                "Deliver damaged messages that can still be decoded, instead of dropping them",
                FaultRange::Flag,
            )
            .option("no-checksum")
            .default(1.0),
        ],
    },
    group: FaultGroup::Radio,
    takes_role: false,
    examples: &[
        (
            r#"{"corrupt": {"p": 0.0005}}"#,
            "each bit of a payload flips with probability `p`; receivers drop damaged messages",
        ),
        (
            r#"{"corrupt": {"from": "green", "p": 0.002, "checksum": false}}"#,
            "damaged messages that can still be decoded are delivered as they are",
        ),
    ],
    commands: &[
        ("corrupt --p 0.0005", "bit errors on all links"),
        (
            "corrupt --p 0.002 --from green --no-checksum",
            "damaged messages are delivered",
        ),
    ],
    ..FaultKind::OF_ROBOT
};

/// Bit errors in messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Corruption {
    #[serde(default)]
    pub from: LinkEnd,
    #[serde(default)]
    pub to: LinkEnd,
    /// The probability that a bit of the payload flips, 0 to 1. Bits are independent of each other.
    pub p: f64,
    /// True if receivers drop damaged messages. Otherwise they receive the damaged messages that can be decoded.
    #[serde(default = "has_checksum")]
    pub checksum: bool,
}

fn has_checksum() -> bool {
    true
}

impl Target for Corruption {}
