//! The fault `add`.

use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{FaultKind, FaultSpec};
use crate::{Problem, name_remedy};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "add",
        about: "Add a robot that is absent in the scenario to the mission",
        ..FaultKind::OF_ROBOT.spec
    },
    healing: Some("it is removed"),
    takes_role: false,
    check,
    examples: &[(
        r#"{"add": "red"}"#,
        "a robot that the scenario marks as `absent` joins the mission, with body and process",
    )],
    commands: &[("add red --at 2min", "joins after two minutes")],
    ..FaultKind::OF_ROBOT
};

/// Checks that the scenario marks the robot as absent.
fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    let Fault::Add(robot) = fault else {
        return Ok(());
    };
    let absent = checker.scenario.robots.iter().filter(|robot| robot.absent);
    if absent.clone().any(|absent| absent.name == *robot) {
        return Ok(());
    }
    let what = format!("'{robot}' is in the mission from its start");
    let known = absent.map(|robot| robot.name.as_str());
    let remedy = format!(
        "name a robot that the scenario marks as absent: {}",
        name_remedy(robot, known)
    );
    Err(Problem::at(["fault", "add"], what, remedy))
}
