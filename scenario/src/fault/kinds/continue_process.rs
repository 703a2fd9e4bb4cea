//! The fault `continue`.

use crate::fault::spec::{FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "continue",
        about: "Send SIGCONT to a robot's process, to end a pause early",
        ..FaultKind::OF_ROBOT.spec
    },
    healing: None,
    takes_role: false,
    examples: &[(r#"{"continue": "gold"}"#, "SIGCONT: ends a pause early")],
    commands: &[("continue gold", "now")],
    ..FaultKind::OF_ROBOT
};
