//! The fault `kill`.

use crate::fault::spec::{FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "kill",
        about: "Send SIGKILL to a robot's process; cleared by a restart in a new incarnation",
        ..FaultKind::OF_ROBOT.spec
    },
    healing: Some("it starts again in a new incarnation, without memory"),
    examples: &[(r#"{"kill": "gold"}"#, "SIGKILL to the robot's process")],
    commands: &[("kill gold --at 60s", "without a restart")],
    ..FaultKind::OF_ROBOT
};
