//! The fault `sensor`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{
    FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec, Mode, ModeForm, ModeSize,
};
use crate::fault::{Device, Fault};
use crate::limits::{FRACTION, LONGEST_M, check_known, closed};
use crate::{Problem, Robot, name_remedy};

const ERROR: ModeSize = ModeSize::Error {
    m: closed(-LONGEST_M, LONGEST_M, "m"),
    deg: closed(-360.0, 360.0, "degrees"),
};

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
                    modes: &[
                        Mode::alone("dead"),
                        Mode::alone("stuck"),
                        Mode::new("noise", ERROR, "a size in meters"),
                        Mode::new("bias", ERROR, "a size in meters"),
                        Mode::new(
                            "dropout",
                            ModeSize::Number(FRACTION),
                            "a share of the steps, 0 to 1",
                        ),
                    ],
                    size: "Size: for noise (standard deviation) and bias in m; for dropout the share of steps, 0 to 1",
                    deg: Some("Heading error for noise and bias of the position sensor, degrees"),
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

/// Checks that the robot has the device, and that the device can fail in this mode. A missing device cannot fail.
fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    let Fault::Sensor(SensorFault {
        robot,
        device,
        mode,
    }) = fault
    else {
        return Ok(());
    };
    let at = ["fault", "sensor", "device"];
    let mission = checker.catalog.mission;
    let known = Device::names_for(mission);
    check_known(at, "there is no choice", device.as_str(), known)?;
    let has = |robot: &&Robot| robot.has_device(device.as_str());
    let with = checker.scenario.robots.iter().filter(has);
    let mut with = with.map(|robot| robot.name.as_str());
    let is_there = with.clone().any(|name| name == robot);
    if !is_there && Device::is_optional(device.as_str(), mission) {
        let what = format!("'{robot}' has no '{device}'");
        let remedy = format!("name one that has it: {}", name_remedy(robot, &mut with));
        return Err(Problem::at(at, what, remedy));
    }
    let has_size = matches!(mode, SensorMode::Noise(_) | SensorMode::Bias(_));
    if has_size && !device.measures_lengths(mission) {
        let what = format!("'{device}' does not measure lengths");
        let remedy = "use dead, stuck or dropout";
        return Err(Problem::at(["fault", "sensor", "mode"], what, remedy));
    }
    Ok(())
}
