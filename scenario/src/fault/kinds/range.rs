//! The fault `range`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};
use crate::limits::FARTHEST_M;

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "range",
        about: "Limit the radio range",
        arguments: &[FaultArgument::at(
            "range_m",
            "Maximum distance between the robots' centers, m",
            FaultRange::Above(FARTHEST_M),
        )],
    },
    group: FaultGroup::Radio,
    takes_role: false,
    examples: &[(
        r#"{"range": {"range_m": 3.0}}"#,
        "messages between robots farther apart than this, center to center, are lost",
    )],
    commands: &[("range 5", "at most 5 m")],
    ..FaultKind::OF_ROBOT
};

/// A limit of the radio range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeFault {
    /// The maximum distance, center to center, m.
    pub range_m: f32,
}

impl Target for RangeFault {}
