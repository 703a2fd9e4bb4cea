//! How a bar gives way: without inertia, as a uniform rod that slides on even friction.
//!
//! A rod that is pushed at right angles to it, `c` from its middle, turns about the point of it that lies on the other side of the middle, at a
//! distance `q` from it where friction's force and torque balance the push: `2·q·c = L²/4 - q²`. Pushed at its very end it turns about
//! the point `L/√2` from there, and the other end goes back by `√2 - 1` of the way.

use alliance_proto::readings::Pose;
use glam::Vec2;

use crate::push::bar::{End, point_at, seen_from};

/// Cosine of the greatest angle between a body's heading and the bar's normal with which it does not slip: of 30°.
const GRIPS: f32 = 0.866;

/// A body that drives against a bar from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    /// The end that it pushes.
    pub end: End,
    /// Where, as the distance from the middle to the left, m.
    pub along_m: f32,
    /// How far the point of contact gives way, of each meter that the body drives, m.
    pub share: f32,
}

/// Why a bar does not give way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slip {
    /// The body drives at more than 30° from the bar's normal.
    Angle,
    /// It pushes in the middle third.
    Middle,
    /// The bar is stuck.
    Fixed,
    /// The bar would run over something, or stand too much askew.
    Stopped,
}

impl Slip {
    /// As in the log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Middle => "middle",
            Self::Fixed => "fixed",
            Self::Stopped => "stopped",
        }
    }
}

/// How a body pushes a bar of that length that it drives against; `None`: not from behind.
pub(super) fn contact(
    pose: &Pose,
    length_m: f32,
    center: Vec2,
    ahead: Vec2,
) -> Option<Result<Contact, Slip>> {
    let seen = seen_from(pose, center);
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
            end: End::on_side(seen.y),
            along_m: seen.y,
            share,
        })
    })
}

/// Where the point lies about which a rod turns that is pushed so far from its middle, on the other side of it, m.
pub(super) fn turns_about(along_m: f32, length_m: f32) -> f32 {
    let away_m = along_m.abs();
    let half_m = length_m / 2.0;
    let beyond_m = (away_m * away_m + half_m * half_m).sqrt() - away_m;
    -beyond_m.copysign(along_m)
}

/// The bar after the point of contact has come forward by that way, when it turns about a point of its axis.
pub(super) fn turned(pose: &Pose, contact: &Contact, pivot_m: f32, way_m: f32) -> Pose {
    let by_rad = -way_m / (contact.along_m - pivot_m);
    let pivot = point_at(pose, Vec2::new(0.0, pivot_m));
    let mut turned = Pose {
        heading_rad: pose.heading_rad + by_rad,
        ..*pose
    };
    let moved = point_at(&turned, Vec2::new(0.0, pivot_m));
    turned.position += pivot - moved;
    turned
}
