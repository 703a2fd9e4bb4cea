//! The fault `terminate`.

use crate::fault::spec::{FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "terminate",
        about: "Send SIGTERM to a robot's process; cleared by a restart in a new incarnation",
        ..FaultKind::OF_ROBOT.spec
    },
    healing: Some("as for `kill`"),
    examples: &[(
        r#"{"terminate": "gold"}"#,
        "SIGTERM; the process ends by itself",
    )],
    commands: &[("terminate gold --for 20s", "restarts after 20 s")],
    ..FaultKind::OF_ROBOT
};
