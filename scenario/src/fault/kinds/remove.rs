//! The fault `remove`.

use crate::fault::spec::{FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "remove",
        about: "Remove a robot's process and body from the mission",
        ..FaultKind::OF_ROBOT.spec
    },
    healing: Some("it returns at its start position"),
    examples: &[(
        r#"{"remove": "gold"}"#,
        "a robot is removed from the mission, with body and process",
    )],
    commands: &[("remove gold", "now")],
    ..FaultKind::OF_ROBOT
};
