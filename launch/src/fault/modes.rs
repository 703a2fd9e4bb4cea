//! How sensors and actuators fail, in words: `noise 0.5`, `one-wheel left`.

use std::str::FromStr;

use alliance_proto::fault::{ActuatorMode, SensorError, SensorMode, Side};

/// What a sensor's failure is called.
pub const SENSOR_MODES: [&str; 5] = ["dead", "stuck", "noise", "bias", "dropout"];

/// What an actuator's failure is called.
pub const ACTUATOR_MODES: [&str; 5] = ["dead", "slowed", "turn-bias", "one-wheel", "gripper"];

/// A sensor's failure; `size` in m or as a share, `deg` in degrees.
///
/// # Errors
/// When the size is missing, wrong, or too much.
pub fn sensor_mode(mode: &str, size: Option<&str>, deg: Option<f32>) -> Result<SensorMode, String> {
    if deg.is_some() && !matches!(mode, "noise" | "bias") {
        return Err(format!("'{mode}' has no --deg; noise and bias have"));
    }
    let error = || {
        Ok::<_, String>(SensorError {
            m: number(mode, size, "its size in meters")?,
            deg: deg.unwrap_or_default(),
        })
    };
    match mode {
        "dead" => alone(mode, size, SensorMode::Dead),
        "stuck" => alone(mode, size, SensorMode::Stuck),
        "noise" => Ok(SensorMode::Noise(error()?)),
        "bias" => Ok(SensorMode::Bias(error()?)),
        "dropout" => number(mode, size, "its share of the steps, 0 to 1").map(SensorMode::Dropout),
        _ => Err(unknown(mode, &SENSOR_MODES)),
    }
}

/// An actuator's failure; `size` as a share, in degrees/s, or a side.
///
/// # Errors
/// When the size is missing, wrong, or too much.
pub fn actuator_mode(mode: &str, size: Option<&str>) -> Result<ActuatorMode, String> {
    match mode {
        "dead" => alone(mode, size, ActuatorMode::Dead),
        "gripper" => alone(mode, size, ActuatorMode::Gripper),
        "slowed" => {
            number(mode, size, "what is left of its speed, 0 to 1").map(ActuatorMode::Slowed)
        }
        "turn-bias" => number(mode, size, "its degrees per second").map(ActuatorMode::TurnBias),
        "one-wheel" => match size {
            Some("left") => Ok(ActuatorMode::OneWheel(Side::Left)),
            Some("right") => Ok(ActuatorMode::OneWheel(Side::Right)),
            _ => Err("'one-wheel' needs the dead one: left or right".to_owned()),
        },
        _ => Err(unknown(mode, &ACTUATOR_MODES)),
    }
}

fn alone<M>(name: &str, size: Option<&str>, mode: M) -> Result<M, String> {
    match size {
        None => Ok(mode),
        Some(size) => Err(format!("'{name}' has no size; leave '{size}' out")),
    }
}

fn number<T: FromStr>(mode: &str, size: Option<&str>, what: &str) -> Result<T, String> {
    let given = size.map_or_else(String::new, |size| format!(", not '{size}'"));
    size.and_then(|size| size.parse().ok())
        .ok_or_else(|| format!("'{mode}' needs {what}{given}"))
}

fn unknown(mode: &str, known: &[&str]) -> String {
    format!("'{mode}' is no mode; there are {}", known.join(", "))
}
