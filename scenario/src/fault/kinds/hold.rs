//! The fault `hold`.

use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "hold",
        about: "Hold messages back until the fault ends, then deliver them all at once",
        arguments: &[FaultArgument::FROM, FaultArgument::TO],
    },
    group: FaultGroup::Radio,
    healing: Some("all held messages are delivered at once"),
    takes_role: false,
    examples: &[(
        r#"{"hold": {"to": "blue"}}"#,
        "messages are held back until the fault heals, and then arrive all at once",
    )],
    commands: &[("hold --from gold --for 10s", "delivered after 10 s")],
    ..FaultKind::OF_ROBOT
};
