//! The fault `restart`.

use crate::fault::spec::{FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "restart",
        about: "Start a robot's process in a new incarnation; a running process is killed first",
        ..FaultKind::OF_ROBOT.spec
    },
    healing: None,
    takes_role: false,
    examples: &[(
        r#"{"restart": "gold"}"#,
        "the process starts in a new incarnation; a live process is killed first",
    )],
    commands: &[("restart gold", "now, in a new incarnation")],
    ..FaultKind::OF_ROBOT
};
