//! The fault `actuator`.

use std::fmt::{self, Display, Formatter};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker, share, within};
use crate::fault::modes::{alone, format, in_file, number, unknown};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec, ModeForm};

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
                    names: &MODES,
                    size: "Size: slowed: remaining share of the speed; turn-bias: degrees/s; one-wheel: left or right",
                    deg: None,
                    parse,
                    format: format::<ActuatorMode>,
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

/// The names of the modes.
const MODES: [&str; 5] = ["dead", "slowed", "turn-bias", "one-wheel", "gripper"];

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

impl Display for ActuatorMode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dead => f.write_str("dead"),
            Self::Slowed(share) => write!(f, "slowed {share}"),
            Self::TurnBias(deg_s) => write!(f, "turn-bias {deg_s}"),
            Self::OneWheel(Side::Left) => f.write_str("one-wheel left"),
            Self::OneWheel(Side::Right) => f.write_str("one-wheel right"),
            Self::Gripper => f.write_str("gripper"),
        }
    }
}

/// Parses a mode. `size` is a share, in degrees/s, or a side.
fn parse(mode: &str, size: Option<&str>, _: Option<f32>) -> Result<toml::Value, String> {
    let mode = match mode {
        "dead" => alone(mode, size, ActuatorMode::Dead)?,
        "gripper" => alone(mode, size, ActuatorMode::Gripper)?,
        "slowed" => {
            let what = "the remaining share of the speed, 0 to 1";
            ActuatorMode::Slowed(number(mode, size, what)?)
        }
        "turn-bias" => {
            ActuatorMode::TurnBias(number(mode, size, "a turn rate in degrees per second")?)
        }
        "one-wheel" => match size {
            Some("left") => ActuatorMode::OneWheel(Side::Left),
            Some("right") => ActuatorMode::OneWheel(Side::Right),
            _ => return Err("'one-wheel' needs the failed wheel: left or right".to_owned()),
        },
        _ => return Err(unknown(mode, &MODES)),
    };
    in_file(mode)
}

/// Checks the size of the mode.
fn check(fault: &Fault, _: &Checker<'_>) -> Checked {
    let Fault::Actuator(fault) = fault else {
        return Ok(());
    };
    let field = &["fault", "actuator", "mode"];
    match fault.mode {
        ActuatorMode::Slowed(part) => share(field, part),
        ActuatorMode::TurnBias(deg_s) => within(field, deg_s, -3600.0, 3600.0, "degrees/s"),
        ActuatorMode::Dead | ActuatorMode::OneWheel(_) | ActuatorMode::Gripper => Ok(()),
    }
}
