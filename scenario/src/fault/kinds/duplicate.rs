//! The fault `duplicate`.

use crate::fault::LinkChance;
use crate::fault::spec::{FaultGroup, FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "duplicate",
        about: "Deliver a share of messages twice",
        arguments: LinkChance::ARGUMENTS,
    },
    group: FaultGroup::Radio,
    takes_role: false,
    examples: &[(r#"{"duplicate": {"p": 0.1}}"#, "messages arrive twice")],
    commands: &[("duplicate --p 0.1", "one message in ten")],
    ..FaultKind::OF_ROBOT
};
