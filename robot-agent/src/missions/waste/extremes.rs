//! The smallest and largest x and y that a robot knows to be inside the border (thesis §4.1.2.1).

use alliance_proto::readings::{Pose, Readings};
use alliance_proto::team::Locations;
use glam::Vec2;

use super::find::Compass;
use crate::body::wrap;

/// A border sensor that looks this exactly at a wall tells which wall it sees, rad.
const SQUARE_RAD: f32 = 0.3;

/// Extremes of all points that are inside the border: the robot's own places, and what its border sensors measured from
/// there. Each lies inside or on the border, so that they never exceed it, and reach it where it was sensed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Extremes {
    known: Option<Locations>,
    /// Which walls were sensed, by [`Compass`].
    sensed: [bool; 4],
}

impl Extremes {
    /// Joins one step's readings of a robot of that radius.
    pub fn join(&mut self, readings: &Readings, radius_m: f32) {
        let Some(pose) = readings.pose else { return };
        self.include(pose.position);
        let ahead = pose.heading_rad;
        let left = ahead + std::f32::consts::FRAC_PI_2;
        for (sensor, direction) in [(readings.front_border, ahead), (readings.side_border, left)] {
            if let Some(Some(distance)) = sensor {
                self.sense(&pose, direction, radius_m + distance);
            }
        }
    }

    /// Whether that wall was sensed.
    pub fn has_sensed(&self, wall: Compass) -> bool {
        self.sensed[wall as usize]
    }

    /// The border, once all of its walls were sensed.
    pub fn border(&self) -> Option<Locations> {
        self.known
            .filter(|_| self.sensed.iter().all(|&sensed| sensed))
    }

    /// How far the extremes reach in a direction, m along it; only differences mean something.
    pub fn reach(&self, direction: Compass) -> f32 {
        let Some(Locations { min, max }) = self.known else {
            return f32::NEG_INFINITY;
        };
        match direction {
            Compass::West => -min.x,
            Compass::North => max.y,
            Compass::East => max.x,
            Compass::South => -min.y,
        }
    }

    fn sense(&mut self, pose: &Pose, direction: f32, distance: f32) {
        self.include(
            pose.position + Vec2::new(libm::cosf(direction), libm::sinf(direction)) * distance,
        );
        for wall in Compass::CLOCKWISE {
            self.sensed[wall as usize] |= wrap(wall.heading() - direction).abs() < SQUARE_RAD;
        }
    }

    fn include(&mut self, point: Vec2) {
        let known = self.known.get_or_insert(Locations {
            min: point,
            max: point,
        });
        known.min = known.min.min(point);
        known.max = known.max.max(point);
    }
}
