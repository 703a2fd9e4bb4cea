//! The fault `move-robot`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::spec::{
    ArgumentForm, FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec,
};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "move-robot",
        about: "Move a robot to another position",
        arguments: &[
            FaultArgument::ROBOT,
            FaultArgument::at("x_m", "New center: x, m", FaultRange::X),
            FaultArgument::at("y_m", "New center: y, m", FaultRange::Y),
            FaultArgument {
                form: ArgumentForm::Optional("heading"),
                ..FaultArgument::at(
                    "heading_deg",
                    "New heading, degrees counter-clockwise from the x axis [default: unchanged]",
                    FaultRange::Within(-360.0, 360.0),
                )
            },
        ],
    },
    group: FaultGroup::World,
    healing: None,
    takes_role: false,
    examples: &[(
        r#"{"move-robot": {"robot": "gold", "x_m": 6.0, "y_m": 2.0, "heading_deg": 90.0}}"#,
        "a robot moves to another place; without `heading_deg` it keeps its heading",
    )],
    commands: &[("move-robot gold 2 3 --heading 90", "to (2, 3)")],
    ..FaultKind::OF_ROBOT
};

/// A new place for a robot's body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MoveRobot {
    pub robot: String,
    /// The x coordinate of the center, m.
    pub x_m: f32,
    /// The y coordinate of the center, m.
    pub y_m: f32,
    /// The new heading, degrees counter-clockwise from x; absent keeps the present one.
    #[serde(default)]
    pub heading_deg: Option<f32>,
}

impl Target for MoveRobot {
    fn robot(&self) -> Option<&str> {
        Some(&self.robot)
    }
}
