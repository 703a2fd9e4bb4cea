//! Free places of a scenario, without its robots and bars: for checks of stated places and for draws.

use glam::Vec2;
use scenario::{Body, Scenario};

use super::space::{ROUNDING_M, Space};

/// The number of places that [`Places::any`] tries.
const TRIES: usize = 10_000;
/// The steps between places in the unit square (Roberts' R2 sequence). They spread evenly, for any number of places.
const R2: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);

/// The border and the solid obstacles of a scenario.
#[derive(Clone, Debug)]
pub struct Places {
    space: Space,
    body: Body,
}

impl Places {
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        Self {
            space: Space::new(scenario, Vec::new()),
            body: scenario.body,
        }
    }

    /// Checks whether a robot can stand at a place. It may touch solids, within rounding.
    #[must_use]
    pub fn can_stand(&self, place: Vec2) -> bool {
        self.has_room(place, self.body.radius_m)
    }

    /// Checks whether a disc fits at a place.
    pub(super) fn has_room(&self, place: Vec2, radius_m: f32) -> bool {
        self.space.fits(place, radius_m, -ROUNDING_M)
    }

    /// Checks the same as [`Floor::can_be_worked_on`](super::Floor::can_be_worked_on).
    #[must_use]
    pub fn can_be_worked_on(&self, place: Vec2, reach_m: f32) -> bool {
        self.space.can_be_worked_on(place, reach_m, &self.body)
    }

    /// Checks the same as [`Floor::can_be_gripped`](super::Floor::can_be_gripped), without other robots.
    #[must_use]
    pub fn can_be_gripped(&self, thing: Vec2, radius_m: f32) -> bool {
        let body = &self.body;
        self.space.can_be_gripped(thing, radius_m, body, |_| true)
    }

    /// Returns the first of many places in a rectangle, spread evenly, for which `will_do` holds. The rectangle has
    /// a lower left and an upper right corner, m.
    pub fn any(&self, [min, max]: [Vec2; 2], will_do: impl Fn(Vec2) -> bool) -> Option<Vec2> {
        self.spread([min, max]).find(|place| will_do(*place))
    }

    /// Returns many places in a rectangle, spread evenly, m.
    pub fn spread(&self, [min, max]: [Vec2; 2]) -> impl Iterator<Item = Vec2> {
        let shares = (0..TRIES).map(|index| (0.5 + R2 * index as f32).fract());
        shares.map(move |share| min + share * (max - min))
    }
}

#[cfg(test)]
mod tests {
    use scenario::Obstacle;
    use scenario::testkit::default_scenario;

    use super::*;

    /// A block from (3, 3) to (5, 5) in a room of 12 × 9 m. The radius of a robot is 0.2 m.
    fn places() -> Places {
        let block = Obstacle {
            x_m: 3.0,
            y_m: 3.0,
            width_m: 2.0,
            height_m: 2.0,
            penetrability: 0.0,
        };
        Places::of(&Scenario {
            obstacles: vec![block],
            ..default_scenario()
        })
    }

    #[test]
    fn a_robot_stands_beside_a_solid_and_works_within_reach() {
        let places = places();
        let cases = [
            // In the open, and in touch with a wall or the block.
            ([8.0, 4.0], true, true),
            ([0.2, 4.0], true, true),
            ([11.8, 8.8], true, true),
            ([5.2, 4.0], true, true),
            // At a wall or the block: a robot works from beside it.
            ([0.0, 4.0], false, true),
            ([5.0, 4.0], false, true),
            // In a corner of the room the nearest place of a robot, with room to drive, is too far.
            ([0.0, 0.0], false, false),
            // In the block, also near its edge, and outside the room.
            ([4.0, 4.0], false, false),
            ([4.95, 4.0], false, false),
            ([-0.1, 4.0], false, false),
        ];
        for (place, stands, works) in cases {
            let place = Vec2::from(place);
            assert_eq!(places.can_stand(place), stands, "{place}");
            assert_eq!(places.can_be_worked_on(place, 0.3), works, "{place}");
        }
        // A longer reach does not help in a solid, but in a corner.
        assert!(!places.can_be_worked_on(Vec2::splat(4.0), 1000.0));
        assert!(places.can_be_worked_on(Vec2::ZERO, 1000.0));
    }

    #[test]
    fn any_place_is_found_where_there_is_one() {
        let places = places();
        let stands = |place| places.can_stand(place);
        let found = places.any([Vec2::splat(2.5), Vec2::splat(5.0)], stands);
        assert!(found.is_some_and(stands));
        assert_eq!(
            places.any([Vec2::splat(3.0), Vec2::splat(5.0)], stands),
            None
        );
    }
}
