//! The fault `deaf`.

use crate::fault::spec::{FaultGroup, FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "deaf",
        about: "Drop all messages to a robot",
        ..FaultKind::OF_ROBOT.spec
    },
    group: FaultGroup::Radio,
    examples: &[(r#"{"deaf": "gold"}"#, "all messages to this robot are lost")],
    commands: &[("deaf gold --for 30s", "receives nothing for 30 s")],
    ..FaultKind::OF_ROBOT
};
