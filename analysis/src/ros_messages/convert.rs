//! Values of a run in the types of ROS.

use plotters::style::RGBColor;
use ros::messages::{ColorRgba, Header, Point, Pose, Time, turned};
use scenario::time::SimTime;

/// The topic of the simulated time.
pub const CLOCK: &str = "/clock";

/// The frame in which the room is at rest. Tools of ROS use this name by default.
pub const MAP_FRAME: &str = "map";

/// The start of a run, ns. ROS treats 0 as "no time", so each time is later by 1 ns.
const START_NS: u64 = 1;

const SECOND_NS: u64 = 1_000_000_000;

/// Converts a simulated time to a time in ROS, ns.
pub fn nanoseconds(time: SimTime) -> u64 {
    time.0.saturating_mul(1_000_000).saturating_add(START_NS)
}

/// Converts a simulated time to a stamp.
pub fn stamp(time: SimTime) -> Time {
    let whole = nanoseconds(time);
    Time {
        sec: i32::try_from(whole / SECOND_NS).unwrap_or(i32::MAX),
        nanosec: (whole % SECOND_NS) as u32,
    }
}

pub fn header(time: SimTime, frame: impl Into<String>) -> Header {
    Header {
        stamp: stamp(time),
        frame_id: frame.into(),
    }
}

/// Returns the frame of a robot's body: origin at the center, x ahead, y to the left.
pub fn body_frame(name: &str) -> String {
    format!("{name}/base_link")
}

/// Returns the frame of a robot's beams, above the center of its body.
pub fn beam_frame(name: &str) -> String {
    format!("{name}/beams")
}

pub fn point(x: impl Into<f64>, y: impl Into<f64>, z: impl Into<f64>) -> Point {
    Point {
        x: x.into(),
        y: y.into(),
        z: z.into(),
    }
}

/// Creates a pose with a rotation about the vertical axis.
pub fn pose(position: Point, heading_rad: f32) -> Pose {
    Pose {
        position,
        orientation: turned(heading_rad),
    }
}

/// Converts a color, with an opacity from 0 to 1.
pub fn color(RGBColor(red, green, blue): RGBColor, opacity: f64) -> ColorRgba {
    let part = |byte: u8| f32::from(byte) / 255.0;
    ColorRgba {
        r: part(red),
        g: part(green),
        b: part(blue),
        a: opacity as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_begin_one_nanosecond_late() {
        let time = |sec, nanosec| Time { sec, nanosec };
        assert_eq!(stamp(SimTime::ZERO), time(0, 1));
        assert_eq!(stamp(SimTime(61_050)), time(61, 50_000_001));
        assert_eq!(stamp(SimTime(u64::MAX)).sec, i32::MAX);
    }
}
