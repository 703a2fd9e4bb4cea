//! The geometry of a bar: its middle, and the heading in which it is pushed. Its ends lie to the left and to the
//! right.

use glam::Vec2;
use proto::readings::Pose;
use serde::{Deserialize, Serialize};

/// An end of a bar, as seen in the direction of the push.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum BarEnd {
    /// The end with the larger y at the start.
    Left,
    /// The end with the smaller y at the start.
    Right,
}

impl BarEnd {
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// Returns the end on that side of the middle: left if `along_m` is above 0.
    #[must_use]
    pub fn on_side(along_m: f32) -> Self {
        if along_m > 0.0 {
            Self::Left
        } else {
            Self::Right
        }
    }

    /// Returns 1 for the left end, -1 for the right one.
    #[must_use]
    pub fn sign(self) -> f32 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }

    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// Returns the unit vectors of a bar: the direction of the push, and the direction from its right end to its left
/// one.
#[must_use]
pub fn axes(pose: &Pose) -> (Vec2, Vec2) {
    let ahead = Vec2::from_angle(pose.heading_rad);
    (ahead, ahead.perp())
}

/// Returns a point in the frame of a bar: the distance ahead of its middle, and the distance to the left, m.
#[must_use]
pub fn to_bar_frame(pose: &Pose, point: Vec2) -> Vec2 {
    let (ahead, left) = axes(pose);
    let offset = point - pose.position;
    Vec2::new(offset.dot(ahead), offset.dot(left))
}

/// Returns the point at these distances ahead and to the left of a bar's middle, m.
#[must_use]
pub fn from_bar_frame(pose: &Pose, seen: Vec2) -> Vec2 {
    let (ahead, left) = axes(pose);
    pose.position + ahead * seen.x + left * seen.y
}

/// Returns the position of an end of the bar's axis, m.
#[must_use]
pub fn end(pose: &Pose, end: BarEnd, length_m: f32) -> Vec2 {
    from_bar_frame(pose, Vec2::new(0.0, end.sign() * length_m / 2.0))
}

/// Returns the lead of the left end over the right one toward the goal, m.
#[must_use]
pub fn lead_m(pose: &Pose, length_m: f32) -> f32 {
    -length_m * libm::sinf(pose.heading_rad)
}

/// Returns the pose of the bar with that end at `at` and that lead of its left end, m.
#[must_use]
pub fn with_end(at: Vec2, which: BarEnd, lead_m: f32, length_m: f32) -> Pose {
    let sine = (-lead_m / length_m).clamp(-1.0, 1.0);
    let mut pose = Pose {
        position: at,
        heading_rad: libm::asinf(sine),
    };
    pose.position -= end(&pose, which, length_m) - at;
    pose
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn an_end_and_a_lead_determine_the_pose_of_a_bar(x in -9.0..9.0_f32, y in -9.0..9.0_f32, heading_rad in -1.2..1.2_f32) {
            let pose = Pose { position: Vec2::new(x, y), heading_rad };
            for which in BarEnd::BOTH {
                let rebuilt = with_end(end(&pose, which, 2.4), which, lead_m(&pose, 2.4), 2.4);
                prop_assert!(rebuilt.position.distance(pose.position) < 1e-4);
                prop_assert!((rebuilt.heading_rad - heading_rad).abs() < 1e-3);
            }
            let ends = BarEnd::BOTH.map(|which| end(&pose, which, 2.4));
            prop_assert!((ends[0].distance(ends[1]) - 2.4).abs() < 1e-4);
            prop_assert!((ends[0].x - ends[1].x - lead_m(&pose, 2.4)).abs() < 1e-4);
            prop_assert!(ends[0].y > ends[1].y);
        }
    }

    #[test]
    fn an_upright_bar_has_its_left_end_on_top() {
        let pose = Pose {
            position: Vec2::new(3.0, 4.0),
            heading_rad: 0.0,
        };
        assert_eq!(end(&pose, BarEnd::Left, 2.0), Vec2::new(3.0, 5.0));
        assert_eq!(end(&pose, BarEnd::Right, 2.0), Vec2::new(3.0, 3.0));
        assert_eq!(
            to_bar_frame(&pose, Vec2::new(2.5, 4.25)),
            Vec2::new(-0.5, 0.25)
        );
    }
}
