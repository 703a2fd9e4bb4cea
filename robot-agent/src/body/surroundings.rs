//! What the body control senses, and on which side.

use std::f32::consts::FRAC_PI_2;

use alliance_proto::readings::{Hit, Pose, Proximity, Readings};

use super::wrap;

/// Beams that differ by less than this see one flat side, m.
const FLAT_M: f32 = 0.02;

/// On which side of the robot the obstacle is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// To the left.
    Left,
    /// To the right.
    Right,
}

impl Side {
    /// The other side.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// As written to the log.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// +1 for the left, the sense of angles.
    #[must_use]
    pub fn sign(self) -> f32 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }

    /// The heading that has a surface with this outward normal on this side, both rad in one frame.
    #[must_use]
    pub fn along(self, normal: f32) -> f32 {
        wrap(normal + self.sign() * FRAC_PI_2)
    }
}

/// What the body control senses.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Where the robot is.
    pub pose: Pose,
    /// What is solid around it.
    pub proximity: Proximity,
    /// Distance to the border straight ahead where it is in range, m.
    pub border_ahead: Option<f32>,
}

impl Surroundings {
    /// What the readings say; `None` without a position. A dead avoidance sensor sees nothing.
    #[inline]
    #[must_use]
    pub fn of(readings: &Readings) -> Option<Self> {
        Some(Self {
            pose: readings.pose?,
            proximity: readings.proximity.unwrap_or_default(),
            border_ahead: readings.front_border.flatten(),
        })
    }

    /// Free way straight ahead, m; infinite beyond the sensor's range.
    #[must_use]
    pub fn free_ahead(&self) -> f32 {
        self.proximity.ahead[1].map_or(f32::INFINITY, |hit| hit.distance_m)
    }

    /// Free way to the nearest of all things sensed, m; infinite where nothing is.
    #[must_use]
    pub fn nearest_m(&self) -> f32 {
        let Proximity { ahead, left, right } = &self.proximity;
        let hits = [ahead, left, right].into_iter().flatten().flatten();
        hits.map(|hit| hit.distance_m).fold(f32::INFINITY, f32::min)
    }

    /// Whether the nearest thing ahead is the border.
    #[must_use]
    pub fn is_border_ahead(&self) -> bool {
        self.border_ahead
            .is_some_and(|border| border <= self.free_ahead() + FLAT_M)
    }

    /// The beams to one side: front, center, rear.
    #[must_use]
    pub fn beside(&self, side: Side) -> &[Option<Hit>; 3] {
        match side {
            Side::Left => &self.proximity.left,
            Side::Right => &self.proximity.right,
        }
    }

    /// Whether what is ahead may be a disc: a flat side would show at the same distance in an outer beam.
    pub(super) fn may_be_robot(&self, hit: &Hit) -> bool {
        let [left, _, right] = self.proximity.ahead;
        ![left, right]
            .iter()
            .flatten()
            .any(|outer| (outer.distance_m - hit.distance_m).abs() < FLAT_M)
    }
}
