//! The fault `sensor`.

use std::fmt::{self, Display, Formatter};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::checker::{Checked, Checker, FARTHEST_M, share, within, wrong};
use crate::fault::modes::{alone, format, in_file, number, unknown};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec, ModeForm};
use crate::fault::{Device, Fault};
use crate::{Robot, name_remedy};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "sensor",
        about: "Make a sensor fail or return wrong readings",
        arguments: &[
            FaultArgument::ROBOT,
            FaultArgument::at("device", "Name of the sensor", FaultRange::Device),
            FaultArgument::at(
                "mode",
                "Failure mode, such as dead or stuck",
                FaultRange::Mode(ModeForm {
                    names: &MODES,
                    size: "Size: for noise (standard deviation) and bias in m; for dropout the share of steps, 0 to 1",
                    deg: Some("Heading error for noise and bias of the position sensor, degrees"),
                    parse,
                    format: format::<SensorMode>,
                }),
            ),
        ],
    },
    group: FaultGroup::Robot,
    takes_role: false,
    check,
    examples: &[
        (
            r#"{"sensor": {"robot": "blue", "device": "side-border", "mode": "dead"}}"#,
            "the sensor returns no readings",
        ),
        (
            r#"{"sensor": {"robot": "blue", "device": "avoidance", "mode": "stuck"}}"#,
            "the sensor repeats its last reading",
        ),
        (
            r#"{"sensor": {"robot": "gold", "device": "position", "mode": {"noise": {"m": 0.2, "deg": 3.0}}}}"#,
            "each number has a normally distributed error; `m` is the standard deviation of lengths, `deg` (default 0) that of the heading",
        ),
        (
            r#"{"sensor": {"robot": "gold", "device": "front-border", "mode": {"bias": {"m": -0.5}}}}"#,
            "each number has the same constant error",
        ),
        (
            r#"{"sensor": {"robot": "gold", "device": "ground", "mode": {"dropout": 0.25}}}"#,
            "the sensor returns no reading in this share of the steps",
        ),
    ],
    commands: &[
        ("sensor gold position dead", "no readings"),
        ("sensor gold position noise 0.5", "standard deviation 0.5 m"),
    ],
    ..FaultKind::OF_ROBOT
};

/// The names of the modes.
const MODES: [&str; 5] = ["dead", "stuck", "noise", "bias", "dropout"];

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorFault {
    pub robot: String,
    /// The name of the sensing device.
    pub device: Device,
    pub mode: SensorMode,
}

impl Target for SensorFault {
    fn robot(&self) -> Option<&str> {
        Some(&self.robot)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensorMode {
    /// No readings at all.
    Dead,
    /// Repetition of the last reading.
    Stuck,
    /// An independent, normally distributed error of every number.
    Noise(SensorError),
    /// The same error of every number.
    Bias(SensorError),
    /// No reading in this share of the steps, 0 to 1.
    Dropout(f64),
}

/// The size of an error: the standard deviation of noise, or the amount of a bias. Distances and both coordinates have
/// an error in meters, the heading in degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensorError {
    pub m: f32,
    /// The error of the heading, position sensor only, degrees.
    pub deg: f32,
}

impl Display for SensorMode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let sized = |f: &mut Formatter<'_>, name, error: &SensorError| {
            write!(f, "{name} {}", error.m)?;
            if error.deg == 0.0 {
                return Ok(());
            }
            write!(f, " --deg {}", error.deg)
        };
        match self {
            Self::Dead => f.write_str("dead"),
            Self::Stuck => f.write_str("stuck"),
            Self::Noise(error) => sized(f, "noise", error),
            Self::Bias(error) => sized(f, "bias", error),
            Self::Dropout(share) => write!(f, "dropout {share}"),
        }
    }
}

/// Parses a mode. `size` is in m or a share, `deg` in degrees.
fn parse(mode: &str, size: Option<&str>, deg: Option<f32>) -> Result<toml::Value, String> {
    if deg.is_some() && !matches!(mode, "noise" | "bias") {
        return Err(format!(
            "'{mode}' takes no --deg; use it with noise or bias"
        ));
    }
    let error = || {
        Ok::<_, String>(SensorError {
            m: number(mode, size, "a size in meters")?,
            deg: deg.unwrap_or_default(),
        })
    };
    let mode = match mode {
        "dead" => alone(mode, size, SensorMode::Dead)?,
        "stuck" => alone(mode, size, SensorMode::Stuck)?,
        "noise" => SensorMode::Noise(error()?),
        "bias" => SensorMode::Bias(error()?),
        "dropout" => SensorMode::Dropout(number(mode, size, "a share of the steps, 0 to 1")?),
        _ => return Err(unknown(mode, &MODES)),
    };
    in_file(mode)
}

/// Checks that the robot has the device, and the size of the error.
fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    let Fault::Sensor(fault) = fault else {
        return Ok(());
    };
    let device_field = &["fault", "sensor", "device"];
    let mission = checker.catalog.mission;
    if !Device::names_for(mission).any(|name| fault.device == *name) {
        let what = format!("there is no choice '{}'", fault.device);
        let known = &mut Device::names_for(mission);
        let remedy = name_remedy(fault.device.as_str(), known);
        return Err(wrong(device_field, what, &remedy));
    }
    has(checker, device_field, &fault.robot, fault.device.as_str())?;
    let field = &["fault", "sensor", "mode"];
    match fault.mode {
        SensorMode::Dropout(p) => share(field, p),
        SensorMode::Noise(error) | SensorMode::Bias(error) => {
            if !fault.device.measures_lengths(mission) {
                let what = format!("'{}' does not measure lengths", fault.device.as_str());
                return Err(wrong(field, what, "use dead, stuck or dropout"));
            }
            within(field, error.m, -FARTHEST_M, FARTHEST_M, "m")?;
            within(field, error.deg, -360.0, 360.0, "degrees")
        }
        SensorMode::Dead | SensorMode::Stuck => Ok(()),
    }
}

/// Checks that a robot has a device. A missing device cannot fail.
fn has(checker: &Checker<'_>, field: &[&str], robot: &str, device: &str) -> Checked {
    let has = |robot: &&Robot| robot.has_device(device);
    let mut with = checker.scenario.robots.iter().filter(has);
    let is_there = with.clone().any(|with| with.name == robot);
    if is_there || !Device::is_optional(device, checker.catalog.mission) {
        return Ok(());
    }
    let known = &mut with.by_ref().map(|robot| robot.name.as_str());
    let remedy = format!("name one that has it: {}", name_remedy(robot, known));
    Err(wrong(
        field,
        format!("'{robot}' has no '{device}'"),
        &remedy,
    ))
}
