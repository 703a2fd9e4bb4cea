//! The smallest and largest x and y that the robot has found to be inside the border (thesis §4.1.2.1).

use glam::Vec2;
use proto::mission::items::Locations;
use proto::readings::{Pose, Readings};

use super::compass::Compass;
use robot_agent::body::wrap;

/// The maximum angle between a border sensor and the normal of a wall at which the reading identifies the wall, rad.
const SQUARE_RAD: f32 = 0.3;

/// The extremes of all points inside the border: the robot's own positions and the points measured by its border
/// sensors. They never exceed the border, and they reach it where a sensor has measured it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Extremes {
    known: Option<Locations>,
    /// The walls that were sensed, indexed by [`Compass`].
    sensed: [bool; 4],
}

impl Extremes {
    pub fn join(&mut self, readings: &Readings, radius_m: f32) {
        let Some(pose) = readings.pose else { return };
        self.include(pose.position);
        let ahead = pose.heading_rad;
        let left = ahead + std::f32::consts::FRAC_PI_2;
        for (sensor, angle_rad) in [(readings.front_border, ahead), (readings.side_border, left)] {
            if let Some(Some(distance)) = sensor {
                self.sense(&pose, angle_rad, radius_m + distance);
            }
        }
    }

    pub fn has_sensed(&self, wall: Compass) -> bool {
        self.sensed[wall as usize]
    }

    /// Returns the border after all walls were sensed.
    pub fn border(&self) -> Option<Locations> {
        self.known
            .filter(|_| self.sensed.iter().all(|&sensed| sensed))
    }

    /// Returns the coordinate of the extreme in a direction, m. Only differences between results are meaningful.
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

    fn sense(&mut self, pose: &Pose, angle_rad: f32, distance: f32) {
        self.include(pose.position + Vec2::from_angle(angle_rad) * distance);
        for wall in Compass::CLOCKWISE {
            self.sensed[wall as usize] |= wrap(wall.heading() - angle_rad).abs() < SQUARE_RAD;
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RADIUS_M: f32 = 0.2;
    const SIZE: Vec2 = Vec2::new(12.0, 9.0);

    /// Returns the readings of a robot with both border sensors in a room of [`SIZE`].
    fn readings(position: Vec2, heading_rad: f32) -> Readings {
        let border = |angle_rad: f32| {
            let ray = Vec2::from_angle(angle_rad);
            // A ray along a wall never meets it.
            let to_far_wall = ((SIZE - position) / ray.max(Vec2::ZERO).abs()).min_element();
            let to_near_wall = (position / (-ray).max(Vec2::ZERO).abs()).min_element();
            let distance = to_far_wall.min(to_near_wall);
            Some(Some(distance - RADIUS_M).filter(|free| *free <= 0.5))
        };
        Readings {
            pose: Some(Pose {
                position,
                heading_rad,
            }),
            front_border: border(heading_rad),
            side_border: border(heading_rad + std::f32::consts::FRAC_PI_2),
            ..Readings::default()
        }
    }

    #[test]
    fn the_border_is_known_once_all_walls_were_sensed() {
        let mut extremes = Extremes::default();
        let lost = Readings {
            pose: None,
            ..readings(Vec2::ONE, 0.0)
        };
        extremes.join(&lost, RADIUS_M);
        assert_eq!(extremes, Extremes::default());
        for (x, y, wall) in [
            (0.5, 4.0, Compass::West),
            (4.0, 8.5, Compass::North),
            (11.6, 4.0, Compass::East),
            (4.0, 0.3, Compass::South),
        ] {
            assert_eq!(extremes.border(), None);
            extremes.join(&readings(Vec2::new(x, y), wall.heading()), RADIUS_M);
            assert!(extremes.has_sensed(wall));
        }
        let border = extremes.border().unwrap();
        assert!(border.min.abs().max_element() < 1e-5, "{border:?}");
        assert!((border.max - SIZE).abs().max_element() < 1e-5, "{border:?}");
    }

    proptest! {
        #[test]
        fn the_extremes_never_exceed_the_border(
            steps in prop::collection::vec((0.2f32..11.8, 0.2f32..8.8, -3.1f32..3.1), 1..50)
        ) {
            let mut extremes = Extremes::default();
            for (x, y, heading) in steps {
                extremes.join(&readings(Vec2::new(x, y), heading), RADIUS_M);
            }
            prop_assert!(extremes.reach(Compass::West) <= 1e-4);
            prop_assert!(extremes.reach(Compass::South) <= 1e-4);
            prop_assert!(extremes.reach(Compass::East) <= SIZE.x + 1e-4);
            prop_assert!(extremes.reach(Compass::North) <= SIZE.y + 1e-4);
        }
    }
}
