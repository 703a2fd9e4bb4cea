//! The fault `babble`.

use crate::fault::spec::{FaultGroup, FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "babble",
        about: "Make a robot broadcast that it works while it does nothing",
        ..FaultKind::OF_ROBOT.spec
    },
    group: FaultGroup::Robot,
    examples: &[(
        r#"{"babble": "gold"}"#,
        "the robot continues to broadcast its activity but does not act",
    )],
    commands: &[("babble gold --when \"gold picks\"", "at an event")],
    ..FaultKind::OF_ROBOT
};
