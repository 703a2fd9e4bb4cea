//! The border of a run and its frame of coordinates.

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::Scenario;
use super::error::Problem;
use super::limits::{LONGEST_M, NumberRange, above_zero, closed};
use super::path::KeyPath;

/// The border: a rectangle. All coordinates of a run are in its frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Room {
    /// The x coordinate of the lower left corner, m.
    #[serde(skip_serializing_if = "is_zero")]
    pub x_m: f32,
    /// The y coordinate of the lower left corner, m.
    #[serde(skip_serializing_if = "is_zero")]
    pub y_m: f32,
    /// Extent in x, m.
    pub width_m: f32,
    /// Extent in y, m.
    pub height_m: f32,
}

impl Default for Room {
    fn default() -> Self {
        Self::of_size(12.0, 9.0)
    }
}

fn is_zero(at_m: &f32) -> bool {
    *at_m == 0.0
}

/// The least length of a step and of a radius, as a multiple of [`Room::resolution_m`].
const LEAST_RESOLUTIONS: f32 = 10.0;

impl Room {
    /// Creates a room with its lower left corner at (0, 0).
    #[must_use]
    pub const fn of_size(width_m: f32, height_m: f32) -> Self {
        Self {
            x_m: 0.0,
            y_m: 0.0,
            width_m,
            height_m,
        }
    }

    /// Returns the lower left corner, m.
    #[inline]
    #[must_use]
    pub fn low(&self) -> Vec2 {
        Vec2::new(self.x_m, self.y_m)
    }

    /// Returns the upper right corner, m.
    #[inline]
    #[must_use]
    pub fn high(&self) -> Vec2 {
        self.low() + self.size()
    }

    /// Returns the extents, m.
    #[inline]
    #[must_use]
    pub fn size(&self) -> Vec2 {
        Vec2::new(self.width_m, self.height_m)
    }

    /// Returns the place at these shares of the extents, m; (0, 0) is the lower left corner.
    #[must_use]
    pub fn at(&self, shares: Vec2) -> Vec2 {
        self.low() + shares * self.size()
    }

    /// Returns the place in the middle, m.
    #[must_use]
    pub fn middle(&self) -> Vec2 {
        self.at(Vec2::splat(0.5))
    }

    /// Returns whether a place lies in the room or on its border.
    #[must_use]
    pub fn contains(&self, place: Vec2) -> bool {
        place.cmpge(self.low()).all() && place.cmple(self.high()).all()
    }

    /// Returns the distance of a place from the nearest side of the border, m; negative outside.
    #[inline]
    #[must_use]
    pub fn to_border_m(&self, place: Vec2) -> f32 {
        (place - self.low()).min(self.high() - place).min_element()
    }

    /// Returns the range of x coordinates.
    #[must_use]
    pub fn range_x(&self) -> NumberRange {
        closed(self.low().x.into(), self.high().x.into(), "m")
    }

    /// Returns the range of y coordinates.
    #[must_use]
    pub fn range_y(&self) -> NumberRange {
        closed(self.low().y.into(), self.high().y.into(), "m")
    }

    /// Returns the largest absolute value of a coordinate, m.
    #[must_use]
    pub fn farthest_m(&self) -> f32 {
        self.low().abs().max(self.high().abs()).max_element()
    }

    /// Returns the greatest distance between two neighboring numbers of single precision in the room, m: 0.06 mm at 1 km
    /// and 8 mm at 100 km.
    #[must_use]
    pub fn resolution_m(&self) -> f32 {
        let farthest_m = self.farthest_m();
        farthest_m.next_up() - farthest_m
    }

    /// Returns the least length of a step and the least radius of a robot, m. A shorter step would round to another
    /// direction. Rooms within [`LONGEST_M`] have no such limit.
    #[must_use]
    pub fn least_step_m(&self) -> f32 {
        if f64::from(self.farthest_m()) <= LONGEST_M {
            return 0.0;
        }
        LEAST_RESOLUTIONS * self.resolution_m()
    }

    /// Rejects a room with an extent or a coordinate beyond `farthest_m`.
    ///
    /// # Errors
    /// Returns the first mistake.
    pub fn check(&self, farthest_m: f64) -> Result<(), Problem> {
        let (place, side) = (
            closed(-farthest_m, farthest_m, "m"),
            above_zero(farthest_m, "m"),
        );
        place.check(["room", "x_m"], self.x_m)?;
        place.check(["room", "y_m"], self.y_m)?;
        side.check(["room", "width_m"], self.width_m)?;
        side.check(["room", "height_m"], self.height_m)?;
        let high = self.high();
        for (key, high) in [("width_m", high.x), ("height_m", high.y)] {
            if f64::from(high) > farthest_m {
                let what = format!("the room ends at {high} m");
                let remedy = format!("keep it within {farthest_m} m");
                return Err(Problem::at(["room", key], what, remedy));
            }
        }
        Ok(())
    }
}

/// Rejects bodies and steps that are too small for the resolution of a room's coordinates.
pub(super) fn check_resolution(scenario: &Scenario) -> Result<(), Problem> {
    let room = &scenario.room;
    let least_m = room.least_step_m();
    let problem = |key: KeyPath, what: String, remedy: String| {
        let (farthest_m, resolution_m) = (room.farthest_m(), room.resolution_m());
        let what = format!(
            "{what}, and coordinates of {farthest_m} m have a resolution of {resolution_m} m"
        );
        Err(Problem::at(key, what, remedy))
    };
    let radius_m = scenario.body.radius_m;
    if radius_m < least_m {
        let key = KeyPath::new(["body", "radius_m"]);
        let remedy = format!("use at least {least_m} m, or a room nearer to (0, 0)");
        return problem(key, format!("the radius is {radius_m} m"), remedy);
    }
    let step_s = scenario.step_ms as f32 / 1000.0;
    for (index, robot) in scenario.robots.iter().enumerate() {
        let speed_m_s = scenario.body_of(robot).speed_m_s;
        if speed_m_s * step_s < least_m {
            let key = if robot.speed_m_s.is_some() {
                KeyPath::new(["robots"]).index(index).key("speed_m_s")
            } else {
                KeyPath::new(["body", "speed_m_s"])
            };
            let what = format!("a step is {} m", speed_m_s * step_s);
            let remedy = format!("use a speed or step_ms for steps of at least {least_m} m");
            return problem(key, what, remedy);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::FARTHEST_M;
    use crate::testkit::default_scenario;

    #[test]
    fn corners_and_shares_are_in_the_frame() {
        let room = Room {
            x_m: -50.0,
            y_m: 20.0,
            ..Room::of_size(100.0, 40.0)
        };
        assert_eq!(room.high(), Vec2::new(50.0, 60.0));
        assert_eq!(room.middle(), Vec2::new(0.0, 40.0));
        assert_eq!(room.to_border_m(Vec2::new(-48.0, 30.0)), 2.0);
        assert_eq!(room.to_border_m(Vec2::new(0.0, 61.0)), -1.0);
        assert!(room.contains(Vec2::new(-50.0, 60.0)) && !room.contains(Vec2::ZERO));
        assert_eq!(Room::of_size(1e5, 1.0).resolution_m(), 0.007_812_5);
    }

    #[test]
    fn a_room_beyond_the_limit_is_refused() {
        let refusal = |x_m, width_m| {
            let room = Room {
                x_m,
                ..Room::of_size(width_m, 5.0)
            };
            room.check(FARTHEST_M)
                .map_err(|problem| problem.to_string())
        };
        assert_eq!(refusal(-1e5, 1e5), Ok(()));
        assert_eq!(
            refusal(60_000.0, 50_000.0).unwrap_err(),
            "room.width_m: the room ends at 110000 m; keep it within 100000 m"
        );
        assert!(refusal(-1.1e5, 5.0).is_err() && refusal(0.0, 1.1e5).is_err());
    }

    #[test]
    fn steps_below_the_resolution_are_refused() {
        let mut scenario = default_scenario();
        scenario.room = Room::of_size(1e5, 1e5);
        let refusal = check_resolution(&scenario).unwrap_err().to_string();
        assert_eq!(
            refusal,
            "body.speed_m_s: a step is 0.025 m, and coordinates of 100000 m have a resolution of 0.0078125 m; use a \
             speed or step_ms for steps of at least 0.078125 m"
        );
        scenario.body.speed_m_s = 10.0;
        check_resolution(&scenario).unwrap();
        scenario.body.radius_m = 0.05;
        let refusal = check_resolution(&scenario).unwrap_err().to_string();
        assert!(refusal.starts_with("body.radius_m"), "{refusal}");
    }
}
