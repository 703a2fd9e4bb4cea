//! The modes of sensor and actuator faults in text form, such as `noise 0.5` or `one-wheel left`.

use std::str::FromStr;

use scenario::fault::{ActuatorMode, SensorError, SensorMode, Side};

/// The names of the modes of a sensor fault.
pub const SENSOR_MODES: [&str; 5] = ["dead", "stuck", "noise", "bias", "dropout"];

/// The names of the modes of an actuator fault.
pub const ACTUATOR_MODES: [&str; 5] = ["dead", "slowed", "turn-bias", "one-wheel", "gripper"];

/// Parses the mode of a sensor fault. `size` is in m or a share, `deg` in degrees.
///
/// # Errors
/// If the size is missing, invalid, or not allowed.
pub fn sensor_mode(mode: &str, size: Option<&str>, deg: Option<f32>) -> Result<SensorMode, String> {
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
    match mode {
        "dead" => alone(mode, size, SensorMode::Dead),
        "stuck" => alone(mode, size, SensorMode::Stuck),
        "noise" => Ok(SensorMode::Noise(error()?)),
        "bias" => Ok(SensorMode::Bias(error()?)),
        "dropout" => number(mode, size, "a share of the steps, 0 to 1").map(SensorMode::Dropout),
        _ => Err(unknown(mode, &SENSOR_MODES)),
    }
}

/// Parses the mode of an actuator fault. `size` is a share, in degrees/s, or a side.
///
/// # Errors
/// If the size is missing, invalid, or not allowed.
pub fn actuator_mode(mode: &str, size: Option<&str>) -> Result<ActuatorMode, String> {
    match mode {
        "dead" => alone(mode, size, ActuatorMode::Dead),
        "gripper" => alone(mode, size, ActuatorMode::Gripper),
        "slowed" => {
            number(mode, size, "the remaining share of the speed, 0 to 1").map(ActuatorMode::Slowed)
        }
        "turn-bias" => {
            number(mode, size, "a turn rate in degrees per second").map(ActuatorMode::TurnBias)
        }
        "one-wheel" => match size {
            Some("left") => Ok(ActuatorMode::OneWheel(Side::Left)),
            Some("right") => Ok(ActuatorMode::OneWheel(Side::Right)),
            _ => Err("'one-wheel' needs the failed wheel: left or right".to_owned()),
        },
        _ => Err(unknown(mode, &ACTUATOR_MODES)),
    }
}

fn alone<M>(name: &str, size: Option<&str>, mode: M) -> Result<M, String> {
    match size {
        None => Ok(mode),
        Some(size) => Err(format!("'{name}' takes no size; leave '{size}' out")),
    }
}

fn number<T: FromStr>(mode: &str, size: Option<&str>, what: &str) -> Result<T, String> {
    let given = size.map_or_else(String::new, |size| format!(", not '{size}'"));
    size.and_then(|size| size.parse().ok())
        .ok_or_else(|| format!("'{mode}' needs {what}{given}"))
}

fn unknown(mode: &str, known: &[&str]) -> String {
    format!("'{mode}' is not a mode; there are {}", known.join(", "))
}
