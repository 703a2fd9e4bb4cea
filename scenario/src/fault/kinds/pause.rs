//! The fault `pause`.

use crate::fault::spec::{FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "pause",
        about: "Send SIGSTOP to a robot's process; cleared by SIGCONT",
        ..FaultKind::OF_ROBOT.spec
    },
    healing: Some("SIGCONT"),
    examples: &[(r#"{"pause": "gold"}"#, "SIGSTOP")],
    commands: &[("pause gold --for 5s", "silent for 5 s")],
    ..FaultKind::OF_ROBOT
};
