//! Constructors for parts of the well-known message types.

use foxglove::messages::{Color, Pose, Quaternion, Timestamp, Vector3};
use plotters::style::RGBColor;
use scenario::time::SimTime;

/// The frame in which the room is at rest.
pub const WORLD: &str = scenario::names::WORLD;

/// Converts a simulated time to a timestamp.
pub fn stamp(time: SimTime) -> Timestamp {
    let nanos = (time.0 % 1000) as u32 * 1_000_000;
    Timestamp::new(u32::try_from(time.0 / 1000).unwrap_or(u32::MAX), nanos)
}

/// Creates a point or a size, m.
pub fn vector(x: impl Into<f64>, y: impl Into<f64>, z: impl Into<f64>) -> Vector3 {
    Vector3 {
        x: x.into(),
        y: y.into(),
        z: z.into(),
    }
}

/// Creates a rotation about the vertical axis, rad.
pub fn turned(heading_rad: f32) -> Quaternion {
    let (sin, cos) = (f64::from(heading_rad) / 2.0).sin_cos();
    Quaternion {
        x: 0.0,
        y: 0.0,
        z: sin,
        w: cos,
    }
}

/// Creates a pose without rotation.
pub fn at(position: Vector3) -> Pose {
    Pose {
        position: Some(position),
        orientation: Some(turned(0.0)),
    }
}

/// Converts a color, with an opacity from 0 to 1.
pub fn color(RGBColor(red, green, blue): RGBColor, opacity: f64) -> Color {
    let part = |byte: u8| f64::from(byte) / 255.0;
    Color {
        r: part(red),
        g: part(green),
        b: part(blue),
        a: opacity,
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;

    #[test]
    fn times() {
        assert_eq!(stamp(SimTime(61_050)), Timestamp::new(61, 50_000_000));
        assert_eq!(stamp(SimTime::ZERO), Timestamp::new(0, 0));
    }

    #[test]
    fn turns() {
        let half = turned(PI);
        assert!((half.z - 1.0).abs() < 1e-6 && half.w.abs() < 1e-6);
        let right = turned(-PI / 2.0);
        assert!((right.z + 0.5_f64.sqrt()).abs() < 1e-6 && (right.w - 0.5_f64.sqrt()).abs() < 1e-6);
    }
}
