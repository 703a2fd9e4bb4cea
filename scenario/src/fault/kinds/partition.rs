//! The fault `partition`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::Problem;
use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "partition",
        about: "Block messages between groups of robots",
        arguments: &[
            FaultArgument::at(
                "groups",
                "Groups separated by a slash, as in: blue,gold / green",
                FaultRange::Groups,
            ),
            FaultArgument::at(
                "one_way",
                "Let later groups still receive messages of earlier groups",
                FaultRange::Flag,
            )
            .option("one-way"),
        ],
    },
    group: FaultGroup::Radio,
    takes_role: false,
    check,
    examples: &[
        (
            r#"{"partition": {"groups": [["blue", "gold"], ["green"]]}}"#,
            "no messages pass between the groups; robots in no group stay connected to all",
        ),
        (
            r#"{"partition": {"groups": [["blue"], ["gold", "green"]], "one_way": true}}"#,
            "later groups still receive the messages of earlier groups",
        ),
    ],
    commands: &[("partition blue,gold / green --for 30s", "two groups")],
    ..FaultKind::OF_ROBOT
};

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Partition {
    /// The groups of robots. A robot is in one group at most.
    pub groups: Vec<Vec<String>>,
    /// True if later groups still receive messages of earlier ones.
    #[serde(default)]
    pub one_way: bool,
}

impl Target for Partition {}

/// Checks that there are at least two groups, and that each robot is in one group at most.
fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    let Fault::Partition(Partition { groups, .. }) = fault else {
        return Ok(());
    };
    let field = ["fault", "partition", "groups"];
    if groups.len() < 2 || groups.iter().any(Vec::is_empty) {
        let what = "a partition has at least two groups, none of them empty";
        return Err(Problem::at(
            field,
            what,
            "write them as in \"blue,gold / green\"",
        ));
    }
    let mut seen = Vec::new();
    for robot in groups.iter().flatten() {
        checker.robot(field, robot)?;
        if seen.contains(&robot) {
            let what = format!("'{robot}' is in two groups");
            return Err(Problem::at(field, what, "name it once"));
        }
        seen.push(robot);
    }
    Ok(())
}
