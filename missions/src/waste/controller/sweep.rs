//! The search for unknown waste: row by row over a spill's area, in alternating directions.

use glam::Vec2;
use proto::mission::items::Locations;

use super::map::KnownPlaces;
use super::sight::FloorView;
use super::views::AT_POINT_M;
use crate::waste::data::sweep_cells;
use robot_agent::body::goal::is_within;

/// The maximum number of cells skipped in a step. It bounds the work for a received border of any size.
const PASSED_MOST: u32 = 1000;

/// The progress of a search. It survives hibernation of the behavior set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sweep {
    done: u64,
}

impl Sweep {
    /// Returns the next place to visit, or `None` when the whole area was seen.
    pub fn next(
        &mut self,
        spill: u32,
        sight: &FloorView,
        sight_m: f32,
        places: &KnownPlaces,
    ) -> Option<Vec2> {
        let Locations { min, max } = places.border();
        let cells = sweep_cells(max - min, sight_m);
        let cell = (max - min) / cells.as_vec2();
        let [columns, rows] = cells.to_array().map(u64::from);
        for _ in 0..PASSED_MOST {
            if self.done >= columns.saturating_mul(rows) {
                return None;
            }
            let (row, along) = (self.done / columns, self.done % columns);
            let column = if row.is_multiple_of(2) {
                along
            } else {
                columns - 1 - along
            };
            let at = min + cell * (Vec2::new(column as f32, row as f32) + 0.5);
            let is_seen =
                sight.covers(at, cell.length() / 2.0) || is_within(at - sight.position, AT_POINT_M);
            if !is_seen && places.nearest_spill(at) == spill {
                return Some(at);
            }
            self.skip_cell();
        }
        Some(sight.position)
    }

    /// Skips the current cell, because there is no way to it.
    pub fn skip_cell(&mut self) {
        self.done += 1;
    }
}

#[cfg(test)]
mod tests {
    use proto::mission::items::SensedItems;

    use super::super::map::{Map, Realms};
    use super::*;
    use crate::waste::data::default_scenario;
    use robot_agent::body::goal::length;

    const SIGHT_M: f32 = 1.2;

    fn sight(position: Vec2) -> FloorView {
        FloorView::new(position, SIGHT_M, SensedItems::new())
    }

    /// Calls a function with the places of the default map in a room of this size.
    fn in_room<T>(size: Vec2, act: impl FnOnce(&KnownPlaces) -> T) -> T {
        let (map, realms) = (Map::of(&default_scenario()), Realms::default());
        let border = Locations {
            min: Vec2::ZERO,
            max: size,
        };
        act(&map.places(&border, &realms))
    }

    /// Returns the places that a robot visits on its search if it can reach all of them.
    fn way(spill: u32, places: &KnownPlaces) -> Vec<Vec2> {
        let mut way = vec![places.spill(spill)];
        let mut sweep = Sweep::default();
        while let Some(at) = sweep.next(spill, &sight(way[way.len() - 1]), SIGHT_M, places) {
            way.push(at);
        }
        way
    }

    #[test]
    fn two_robots_see_the_whole_room_and_drive_only_along_their_rows() {
        for size in [Vec2::new(12.0, 9.0), Vec2::new(6.3, 15.9)] {
            let ways = in_room(size, |places| [way(0, places), way(1, places)]);
            for (x, y) in (0..=60).flat_map(|x| (0..=60).map(move |y| (x, y))) {
                let place = size * Vec2::new(x as f32, y as f32) / 60.0;
                let mut looks = ways.iter().flatten();
                assert!(looks.any(|at| length(place - *at) < SIGHT_M), "{place}");
            }
            let legs = ways.iter().flat_map(|way| way.windows(2));
            let together_m: f32 = legs.map(|leg| length(leg[1] - leg[0])).sum();
            let rows = sweep_cells(size, SIGHT_M).y as f32;
            let most_m = (rows + 2.0) * size.x + 2.0 * size.y;
            assert!(together_m < most_m, "{together_m}");
        }
    }

    #[test]
    fn unreachable_cells_are_skipped() {
        let shut_in = sight(Vec2::ONE);
        let mut sweep = Sweep::default();
        let passed = in_room(Vec2::new(12.0, 9.0), |places| {
            let steps = (0..).take_while(|_| {
                let next = sweep.next(0, &shut_in, SIGHT_M, places);
                sweep.skip_cell();
                next.is_some()
            });
            steps.count()
        });
        assert!((50..130).contains(&passed), "{passed}");
    }

    #[test]
    fn a_border_of_any_size_costs_little_in_a_step() {
        for size in [1e-30, 1e9, 1e38] {
            let mut sweep = Sweep::default();
            in_room(Vec2::splat(size), |places| {
                sweep.next(1, &sight(Vec2::ONE), SIGHT_M, places)
            });
            assert!(sweep.done <= u64::from(PASSED_MOST));
        }
    }
}
