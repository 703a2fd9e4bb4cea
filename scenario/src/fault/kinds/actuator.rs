//! The fault `actuator`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::Problem;
use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{
    FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec, Mode, ModeForm, ModeSize,
};
use crate::limits::{FRACTION, NumberRange, closed};

const TURN_BIAS: NumberRange = closed(-3600.0, 3600.0, "degrees/s");

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "actuator",
        about: "Make a motor or the gripper fail",
        arguments: &[
            FaultArgument::ROBOT,
            FaultArgument::at(
                "mode",
                "Failure mode, such as dead or slowed",
                FaultRange::Mode(ModeForm {
                    modes: &[
                        Mode::alone("dead"),
                        Mode::new(
                            "slowed",
                            ModeSize::Number(FRACTION),
                            "the remaining share of the speed, 0 to 1",
                        ),
                        Mode::new(
                            "turn-bias",
                            ModeSize::Number(TURN_BIAS),
                            "a turn rate in degrees per second",
                        ),
                        Mode::new(
                            "one-wheel",
                            ModeSize::Word(&["left", "right"]),
                            "the failed wheel: left or right",
                        ),
                        Mode::alone("gripper"),
                    ],
                    size: "Size: slowed: remaining share of the speed; turn-bias: degrees/s; one-wheel: left or right",
                    deg: None,
                }),
            ),
        ],
    },
    group: FaultGroup::Robot,
    takes_role: false,
    check,
    examples: &[
        (
            r#"{"actuator": {"robot": "gold", "mode": "dead"}}"#,
            "the drive is dead: the robot neither turns nor moves",
        ),
        (
            r#"{"actuator": {"robot": "gold", "mode": {"slowed": 0.2}}}"#,
            "speed and turn rate are reduced to this share",
        ),
        (
            r#"{"actuator": {"robot": "gold", "mode": {"turn-bias": -10.0}}}"#,
            "an additional turn rate while the robot moves or turns, degrees/s, positive counter-clockwise",
        ),
        (
            r#"{"actuator": {"robot": "gold", "mode": {"one-wheel": "left"}}}"#,
            "the motor of the `left` or `right` wheel is dead: the robot drives around that wheel",
        ),
        (
            r#"{"actuator": {"robot": "gold", "mode": "gripper"}}"#,
            "the gripper neither opens nor closes",
        ),
    ],
    commands: &[("actuator gold slowed 0.5", "half its speed")],
    ..FaultKind::OF_ROBOT
};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActuatorFault {
    pub robot: String,
    pub mode: ActuatorMode,
}

impl Target for ActuatorFault {
    fn robot(&self) -> Option<&str> {
        Some(&self.robot)
    }
}

/// Checks that the robots of the mission have a gripper if it fails.
fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    let Fault::Actuator(ActuatorFault {
        mode: ActuatorMode::Gripper,
        ..
    }) = fault
    else {
        return Ok(());
    };
    if checker.catalog.mission.has_gripper() {
        return Ok(());
    }
    let at = ["fault", "actuator", "mode"];
    let what = "the robots of this mission have no gripper";
    Err(Problem::at(at, what, "choose another mode"))
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ActuatorMode {
    /// A dead drive: the robot neither turns nor moves.
    Dead,
    /// A speed and turn rate reduced to this share, 0 to 1.
    Slowed(f32),
    /// An additional turn rate while the robot is commanded to move or turn, degrees/s, positive counter-clockwise.
    TurnBias(f32),
    /// A dead motor of one wheel: the robot drives around that wheel.
    OneWheel(Side),
    /// A gripper that neither opens nor closes.
    Gripper,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The left side, seen along the robot's heading.
    Left,
    /// The right side, seen along the robot's heading.
    Right,
}
