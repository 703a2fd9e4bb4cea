//! Where spills and deposits are, relative to the border (thesis §4.1.1.1): the same for all robots of a run.

use alliance_proto::scenario::{Scenario, Spill, Spot};
use alliance_proto::team::Locations;
use glam::Vec2;

/// Up to so many places are simply looked at one after the other.
const FEW: usize = 16;
/// Places to a cell, on average.
const PER_CELL: usize = 2;

/// A plan of the room without its size.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    pub(super) spills: Spots,
    pub(super) deposits: Spots,
    pub(super) site_size: Vec2,
}

impl Map {
    /// The map of a scenario.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let waste = &scenario.waste;
        Self {
            spills: Spots::new(waste.spills.iter().map(Spill::spot)),
            deposits: Spots::new(waste.deposits()),
            site_size: Vec2::new(waste.report_site.width_m, waste.report_site.height_m),
        }
    }

    /// Where things are in a border of these extremes.
    pub(super) fn places(&self, border: &Locations) -> Places<'_> {
        let size = border.max - border.min;
        let left = border.min + Vec2::new(0.0, 0.5) * size;
        let half = Vec2::new(0.0, self.site_size.y / 2.0);
        Places {
            map: self,
            min: border.min,
            size,
            site_min: (left - half).max(border.min),
            site_max: (left + half + Vec2::new(self.site_size.x, 0.0)).min(border.max),
        }
    }
}

/// Where things are, once the border is known, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Places<'a> {
    map: &'a Map,
    min: Vec2,
    size: Vec2,
    /// Corners of the report site.
    pub site_min: Vec2,
    pub site_max: Vec2,
}

impl Places<'_> {
    /// Center of a spill.
    pub fn spill(&self, spill: u16) -> Vec2 {
        self.place(self.map.spills.fractions[usize::from(spill)])
    }

    /// The spill whose work it is to carry what lies there.
    pub fn nearest_spill(&self, at: Vec2) -> u16 {
        self.nearest(&self.map.spills, at)
    }

    /// Center of the deposit that is nearest to a place.
    pub fn nearest_deposit(&self, at: Vec2) -> Vec2 {
        let deposits = &self.map.deposits;
        let nearest = self.nearest(deposits, at);
        self.place(deposits.fractions[usize::from(nearest)])
    }

    fn place(&self, fraction: Vec2) -> Vec2 {
        self.min + fraction * self.size
    }

    /// Of two that are equally near, the first.
    fn nearest(&self, spots: &Spots, at: Vec2) -> u16 {
        let fraction = (at - self.min) / self.size;
        let mut around = 0;
        loop {
            let block = spots.block(fraction, Vec2::splat(around as f32));
            let (squared, nearest) = self.nearest_within(spots, &block, at);
            // Nothing outside the block can be nearer than its edge.
            let sure_m = spots.to_edge(&block, fraction, self.size);
            if block.is_all(spots.side) || (sure_m > 0.0 && squared <= sure_m * sure_m) {
                return nearest;
            }
            if squared.is_finite() {
                // Nor is anything nearer than this outside the cells that it reaches into; a little more, for rounding.
                let reach = squared.sqrt() * 1.001 / self.size * spots.side as f32;
                let block = spots.block(fraction, reach);
                return self.nearest_within(spots, &block, at).1;
            }
            around += 1;
        }
    }

    /// The nearest one of a block, and the square of its distance, m²; infinite where there is none.
    fn nearest_within(&self, spots: &Spots, block: &Block, at: Vec2) -> (f32, u16) {
        let mut nearest = (f32::INFINITY, 0);
        for &(fraction, spot) in spots.within(block) {
            let squared = (self.place(fraction) - at).length_squared();
            if squared < nearest.0 || (squared == nearest.0 && spot < nearest.1) {
                nearest = (squared, spot);
            }
        }
        nearest
    }
}

/// Some cells side by side, the last ones included.
struct Block {
    low: (usize, usize),
    high: (usize, usize),
}

impl Block {
    fn is_all(&self, side: usize) -> bool {
        self.low == (0, 0) && self.high == (side - 1, side - 1)
    }
}

/// Places as fractions of the border, and which of them are near to each other.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spots {
    /// By number.
    fractions: Vec<Vec2>,
    /// The border is divided into this many cells each way.
    side: usize,
    /// The same places with their numbers, cell by cell and row by row: those of neighbors in a row stand side by side.
    by_cell: Vec<(Vec2, u16)>,
    /// Where those of each cell begin; and the end.
    begins: Vec<u32>,
}

impl Spots {
    fn new(spots: impl Iterator<Item = Spot>) -> Self {
        let fractions: Vec<Vec2> = spots
            .map(|spot| Vec2::new(spot.x_fraction, spot.y_fraction))
            .collect();
        let side = if fractions.len() <= FEW {
            1
        } else {
            (fractions.len() / PER_CELL).isqrt().max(1)
        };
        let cell = |fraction: Vec2| {
            let (x, y) = (along(fraction.x, side), along(fraction.y, side));
            y * side + x
        };
        let mut by_cell: Vec<(Vec2, u16)> = fractions.iter().copied().zip(0..).collect();
        by_cell.sort_by_key(|&(fraction, _)| cell(fraction));
        let begin = |of: usize| by_cell.partition_point(|&(at, _)| cell(at) < of) as u32;
        Self {
            begins: (0..=side * side).map(begin).collect(),
            fractions,
            side,
            by_cell,
        }
    }

    /// The cells up to so many away, in x and y.
    fn block(&self, fraction: Vec2, around: Vec2) -> Block {
        let (low, high) = (
            fraction - around / self.side as f32,
            fraction + around / self.side as f32,
        );
        Block {
            low: (along(low.x, self.side), along(low.y, self.side)),
            high: (along(high.x, self.side), along(high.y, self.side)),
        }
    }

    fn within(&self, block: &Block) -> impl Iterator<Item = &(Vec2, u16)> + '_ {
        let (low, high) = (block.low, block.high);
        (low.1..=high.1).flat_map(move |y| {
            let begin = self.begins[y * self.side + low.0];
            let end = self.begins[y * self.side + high.0 + 1];
            &self.by_cell[begin as usize..end as usize]
        })
    }

    /// How far a place is from what lies outside the block, m; negative where it lies there itself.
    fn to_edge(&self, block: &Block, fraction: Vec2, size: Vec2) -> f32 {
        let cells = fraction * self.side as f32;
        let beyond = |low: usize, high: usize, at: f32| {
            // Nothing lies beyond the border.
            let below = if low == 0 {
                f32::INFINITY
            } else {
                at - low as f32
            };
            let above = if high + 1 == self.side {
                f32::INFINITY
            } else {
                (high + 1) as f32 - at
            };
            below.min(above)
        };
        let x = beyond(block.low.0, block.high.0, cells.x);
        let y = beyond(block.low.1, block.high.1, cells.y);
        (Vec2::new(x, y) * size / self.side as f32).min_element()
    }
}

/// The cell in which that share of a side lies; outside the border, the nearest one.
fn along(share: f32, side: usize) -> usize {
    // Casts saturate.
    ((share * side as f32) as usize).min(side - 1)
}

#[cfg(test)]
mod tests {
    use alliance_proto::scenario::Spill;
    use proptest::prelude::*;

    use super::*;
    use crate::body::goal::length;

    fn map(spots: &[(f32, f32)]) -> Map {
        let mut scenario = Scenario::default();
        let spill = |&(x_fraction, y_fraction): &(f32, f32)| Spill {
            x_fraction,
            y_fraction,
            ..Spill::default()
        };
        scenario.waste.spills = spots.iter().map(spill).collect();
        Map::of(&scenario)
    }

    #[test]
    fn of_two_that_are_equally_near_the_first_has_the_work() {
        let map = map(&[(0.75, 0.5), (0.25, 0.5)]);
        let border = Locations {
            min: Vec2::ZERO,
            max: Vec2::new(12.0, 9.0),
        };
        let places = map.places(&border);
        assert_eq!(places.nearest_spill(Vec2::new(6.0, 1.0)), 0);
        assert_eq!(places.nearest_spill(Vec2::new(5.9, 1.0)), 1);
        assert_eq!(places.spill(1), Vec2::new(3.0, 4.5));
    }

    proptest! {
        /// Against a look at all of them, also from outside the border and where they crowd.
        #[test]
        fn the_nearest_is_the_nearest(
            spots in prop::collection::vec((0.0..1.0_f32, 0.0..1.0_f32), 1..200),
            crowd in 0.05..1.0_f32,
            size in (1.0..900.0_f32, 1.0..900.0_f32),
            at in (-0.2..1.2_f32, -0.2..1.2_f32),
        ) {
            let spots: Vec<_> = spots.iter().map(|(x, y)| (x * crowd, y)).map(|(x, y)| (x, *y)).collect();
            let map = map(&spots);
            let border = Locations {
                min: Vec2::new(3.0, -2.0),
                max: Vec2::new(3.0 + size.0, size.1 - 2.0),
            };
            let places = map.places(&border);
            let at = border.min + Vec2::new(at.0, at.1) * Vec2::new(size.0, size.1);
            let found = length(places.spill(places.nearest_spill(at)) - at);
            for spill in 0..spots.len() as u16 {
                // Of two that are as good as equally near it is either.
                prop_assert!(found <= length(places.spill(spill) - at) * (1.0 + 1e-6));
            }
        }
    }
}
