//! The fault `reorder`.

use crate::fault::LinkChance;
use crate::fault::spec::{FaultGroup, FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "reorder",
        about: "Deliver a share of messages after the next message of the same sender",
        arguments: LinkChance::ARGUMENTS,
    },
    group: FaultGroup::Radio,
    takes_role: false,
    examples: &[(
        r#"{"reorder": {"from": "gold", "p": 0.1}}"#,
        "messages arrive after the next message of their sender",
    )],
    commands: &[("reorder --p 0.1", "one message in ten")],
    ..FaultKind::OF_ROBOT
};
