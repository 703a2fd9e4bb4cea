//! The motion of a pushed bar, as a uniform rod with even friction and without inertia.
//!
//! A push at right angles, at distance `c` from the middle, turns the rod about a point on the other side of the
//! middle. Its distance `q` balances the force and the torque of friction: `2·q·c = L²/4 - q²`. A push at the very
//! end turns the rod about the point `L/√2` from there, and the other end moves back by `√2 - 1` of the way.

use glam::Vec2;
use proto::readings::Pose;

use crate::push::bar::{BarEnd, from_bar_frame, to_bar_frame};

/// The cosine of 30°, the largest angle between a body's heading and the bar's normal without slip.
const GRIPS: f32 = 0.866;

/// The contact of a body that drives against a bar from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    pub end: BarEnd,
    /// The distance of the contact from the middle, positive to the left, m.
    pub along_m: f32,
    /// The motion of the contact point per meter of the body's way.
    pub share: f32,
}

/// The reason for which a bar does not move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slip {
    /// The body drives at more than 30° from the bar's normal.
    Angle,
    Middle,
    /// A fault holds the bar.
    Fixed,
    /// An object blocks the bar, or it would lean too far.
    Stopped,
}

impl Slip {
    pub fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Middle => "middle",
            Self::Fixed => "fixed",
            Self::Stopped => "stopped",
        }
    }
}

/// Returns the contact of a body that drives against a bar; `None` if it is not behind the bar.
pub(super) fn contact(
    pose: &Pose,
    length_m: f32,
    center: Vec2,
    ahead: Vec2,
) -> Option<Result<Contact, Slip>> {
    let seen = to_bar_frame(pose, center);
    let share = ahead.dot(crate::push::bar::axes(pose).0);
    if seen.x >= 0.0 || seen.y.abs() > length_m / 2.0 || share <= 0.0 {
        return None;
    }
    Some(if share < GRIPS {
        Err(Slip::Angle)
    } else if seen.y.abs() < length_m / 6.0 {
        Err(Slip::Middle)
    } else {
        Ok(Contact {
            end: BarEnd::on_side(seen.y),
            along_m: seen.y,
            share,
        })
    })
}

/// Returns the position on the axis of the point about which a rod turns, m. It is on the other side of the middle.
pub(super) fn pivot_of(along_m: f32, length_m: f32) -> f32 {
    let away_m = along_m.abs();
    let half_m = length_m / 2.0;
    let beyond_m = (away_m * away_m + half_m * half_m).sqrt() - away_m;
    -beyond_m.copysign(along_m)
}

/// Returns the bar after the contact point has moved forward by `way_m`, for a turn about a point of its axis.
pub(super) fn turned_by(pose: &Pose, contact: &Contact, pivot_m: f32, way_m: f32) -> Pose {
    let by_rad = -way_m / (contact.along_m - pivot_m);
    let pivot = from_bar_frame(pose, Vec2::new(0.0, pivot_m));
    let mut turned = Pose {
        heading_rad: pose.heading_rad + by_rad,
        ..*pose
    };
    let moved = from_bar_frame(&turned, Vec2::new(0.0, pivot_m));
    turned.position += pivot - moved;
    turned
}
