//! The fault `mute`.

use crate::fault::spec::{FaultGroup, FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "mute",
        about: "Drop all messages from a robot",
        ..FaultKind::OF_ROBOT.spec
    },
    group: FaultGroup::Radio,
    examples: &[(
        r#"{"mute": "gold"}"#,
        "all messages from this robot are lost",
    )],
    commands: &[("mute gold --for 30s", "sends nothing for 30 s")],
    ..FaultKind::OF_ROBOT
};
