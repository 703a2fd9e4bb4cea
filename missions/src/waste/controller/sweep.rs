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
        spill: u16,
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

    /// Returns the places that a robot visits on its search if it can reach all of them.
    fn way(spill: u16, size: Vec2) -> Vec<Vec2> {
        let (map, realms) = (Map::of(&default_scenario()), Realms::default());
        let border = Locations {
            min: Vec2::ZERO,
            max: size,
        };
        let places = map.places(&border, &realms);
        let mut way = vec![places.spill(spill)];
        let mut sweep = Sweep::default();
        while let Some(at) = sweep.next(spill, &sight(way[way.len() - 1]), SIGHT_M, &places) {
            way.push(at);
        }
        way
    }

    #[test]
    fn two_robots_see_the_whole_room_and_drive_only_along_their_rows() {
        for size in [Vec2::new(12.0, 9.0), Vec2::new(6.3, 15.9)] {
            let ways = [way(0, size), way(1, size)];
            for x in 0..=60 {
                for y in 0..=60 {
                    let place = size * Vec2::new(x as f32, y as f32) / 60.0;
                    let mut looks = ways.iter().flatten();
                    assert!(looks.any(|at| length(place - *at) < SIGHT_M), "{place}");
                }
            }
            let driven_m = |way: &[Vec2]| -> f32 {
                let legs = way.windows(2).map(|leg| length(leg[1] - leg[0]));
                legs.sum()
            };
            let rows = sweep_cells(size, SIGHT_M).y as f32;
            let together_m = driven_m(&ways[0]) + driven_m(&ways[1]);
            assert!(
                together_m < (rows + 2.0) * size.x + 2.0 * size.y,
                "{together_m}"
            );
        }
    }

    #[test]
    fn unreachable_cells_are_skipped() {
        let (map, realms) = (Map::of(&default_scenario()), Realms::default());
        let border = Locations {
            min: Vec2::ZERO,
            max: Vec2::new(12.0, 9.0),
        };
        let places = map.places(&border, &realms);
        let shut_in = sight(Vec2::ONE);
        let mut sweep = Sweep::default();
        let mut passed = 0;
        while sweep.next(0, &shut_in, SIGHT_M, &places).is_some() {
            sweep.skip_cell();
            passed += 1;
        }
        assert!((50..130).contains(&passed), "{passed}");
    }

    #[test]
    fn a_border_of_any_size_costs_little_in_a_step() {
        let (map, realms) = (Map::of(&default_scenario()), Realms::default());
        for size in [1e-30, 1e9, 1e38] {
            let border = Locations {
                min: Vec2::ZERO,
                max: Vec2::splat(size),
            };
            let mut sweep = Sweep::default();
            let places = map.places(&border, &realms);
            sweep.next(1, &sight(Vec2::ONE), SIGHT_M, &places);
            assert!(sweep.done <= u64::from(PASSED_MOST));
        }
    }
}
