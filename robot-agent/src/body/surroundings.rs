//! Sensor readings for body control, and the sides of a robot.

use std::f32::consts::FRAC_PI_2;

use proto::readings::{Hit, Pose, Proximity, Readings};

use super::wrap;

/// The largest difference between beams that meet one flat surface, m.
const FLAT_M: f32 = 0.02;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Left,
    Right,
}

impl Side {
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// Returns +1 for the left, the sense of angles, and -1 for the right.
    #[must_use]
    pub fn sign(self) -> f32 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }

    /// Returns the heading along a surface with that outward normal, with the surface on this side. Both angles are
    /// in one frame, rad.
    #[must_use]
    pub fn along(self, normal: f32) -> f32 {
        wrap(normal + self.sign() * FRAC_PI_2)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    pub pose: Pose,
    pub proximity: Proximity,
    /// The distance to the border straight ahead, m; `None` beyond the sensor's range.
    pub border_ahead: Option<f32>,
}

impl Surroundings {
    /// Extracts the readings; `None` without a position. A dead avoidance sensor reports no obstacle.
    #[inline]
    #[must_use]
    pub fn from_readings(readings: &Readings) -> Option<Self> {
        Some(Self {
            pose: readings.pose?,
            proximity: readings.proximity.unwrap_or_default(),
            border_ahead: readings.front_border.flatten(),
        })
    }

    /// Returns the free distance straight ahead, m; infinite beyond the sensor's range.
    #[must_use]
    pub fn free_ahead(&self) -> f32 {
        self.proximity.ahead[1].map_or(f32::INFINITY, |hit| hit.distance_m)
    }

    /// Returns the distance to the nearest sensed object, m; infinite without one.
    #[must_use]
    pub fn nearest_m(&self) -> f32 {
        let Proximity { ahead, left, right } = &self.proximity;
        let hits = [ahead, left, right].into_iter().flatten().flatten();
        hits.map(|hit| hit.distance_m).fold(f32::INFINITY, f32::min)
    }

    #[must_use]
    pub fn is_border_ahead(&self) -> bool {
        self.border_ahead
            .is_some_and(|border| border <= self.free_ahead() + FLAT_M)
    }

    /// Returns the beams of one side: front, center, rear.
    #[must_use]
    pub fn beside(&self, side: Side) -> &[Option<Hit>; 3] {
        match side {
            Side::Left => &self.proximity.left,
            Side::Right => &self.proximity.right,
        }
    }

    /// Returns whether the object ahead may be a disc. A flat surface has the same distance in an outer beam.
    pub(super) fn may_be_robot(&self, hit: &Hit) -> bool {
        let [left, _, right] = self.proximity.ahead;
        ![left, right]
            .iter()
            .flatten()
            .any(|outer| (outer.distance_m - hit.distance_m).abs() < FLAT_M)
    }
}
