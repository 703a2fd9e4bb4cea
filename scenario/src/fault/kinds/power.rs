//! The fault `power`.

use crate::fault::spec::{FaultGroup, FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "power",
        about: "Turn off the power of a robot's body, which then ignores all commands",
        ..FaultKind::OF_ROBOT.spec
    },
    group: FaultGroup::Robot,
    examples: &[(
        r#"{"power": "gold"}"#,
        "no power: the body ignores all commands, and its energy reads 0, so that the robot gives up its tasks",
    )],
    commands: &[("power gold", "the body ignores commands")],
    ..FaultKind::OF_ROBOT
};
