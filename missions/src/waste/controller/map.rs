//! The places of spills and deposits relative to the border (thesis §4.1.1.1), shared by all robots of a run.

use crate::waste::data::{Spill, Spot, WasteSection};
use std::cell::{Cell, RefCell};

use glam::Vec2;
use proto::mission::items::Locations;
use scenario::Scenario;

/// The maximum number of spots that a linear search handles without a grid.
const FEW: usize = 16;
const PER_CELL: usize = 2;

/// A plan of the room that does not depend on its size.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub(super) spills: Spots,
    pub(super) deposits: Spots,
    pub(super) site_size: Vec2,
}

impl Map {
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let waste = WasteSection::of(scenario);
        Self {
            spills: Spots::new(waste.spills.iter().map(Spill::spot)),
            deposits: Spots::new(waste.deposits()),
            site_size: Vec2::new(waste.report_site.width_m, waste.report_site.height_m),
        }
    }

    /// Returns the places for a border. `realms` is the cache of the calling robot.
    pub(super) fn places<'a>(&'a self, border: &Locations, realms: &'a Realms) -> KnownPlaces<'a> {
        realms.keep_for(*border);
        KnownPlaces {
            map: self,
            realms,
            min: border.min,
            max: border.max,
            size: border.max - border.min,
        }
    }
}

/// A cached result of a search for the nearest spot, with the circle in which it is valid. A robot repeats this search
/// many times per step, mostly at nearby points.
#[derive(Clone, Copy, Debug, Default)]
struct Realm {
    /// The center of the circle, m, and the square of its radius, m².
    center: Vec2,
    squared: f32,
    spot: u32,
    at: Vec2,
}

/// The latest realms of a robot for its current border.
#[derive(Clone, Debug, Default)]
pub(super) struct Realms {
    border: Cell<Option<Locations>>,
    spill: Cell<Realm>,
    deposit: Cell<Realm>,
    /// The spills whose nearest deposit has been computed, in ascending order, and that deposit.
    of_spills: RefCell<Vec<(u32, Vec2)>>,
}

impl Realms {
    fn keep_for(&self, border: Locations) {
        if self.border.get() != Some(border) {
            self.border.set(Some(border));
            self.spill.take();
            self.deposit.take();
            self.of_spills.borrow_mut().clear();
        }
    }
}

/// The places of everything for a known border, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownPlaces<'a> {
    map: &'a Map,
    realms: &'a Realms,
    min: Vec2,
    max: Vec2,
    size: Vec2,
}

impl KnownPlaces<'_> {
    pub fn border(&self) -> Locations {
        Locations {
            min: self.min,
            max: self.max,
        }
    }

    /// Returns the corners of the report site. It lies at the left wall, centered in y, and is cut off at the border.
    pub fn site(&self) -> (Vec2, Vec2) {
        let size = self.map.site_size;
        let left = self.min + Vec2::new(0.0, 0.5) * self.size;
        let half = Vec2::new(0.0, size.y / 2.0);
        (
            (left - half).max(self.min),
            (left + half + Vec2::new(size.x, 0.0)).min(self.max),
        )
    }

    pub fn spill(&self, spill: u32) -> Vec2 {
        self.spot(&self.map.spills, spill)
    }

    /// Returns the spill whose task includes waste at this place.
    pub fn nearest_spill(&self, at: Vec2) -> u32 {
        self.realm(&self.map.spills, &self.realms.spill, at).spot
    }

    pub fn nearest_deposit(&self, at: Vec2) -> Vec2 {
        self.realm(&self.map.deposits, &self.realms.deposit, at).at
    }

    /// Returns the deposit that is the nearest to a spill.
    pub fn deposit_of(&self, spill: u32) -> Vec2 {
        let mut known = self.realms.of_spills.borrow_mut();
        match known.binary_search_by_key(&spill, |&(spill, _)| spill) {
            Ok(found) => known[found].1,
            Err(place) => {
                let deposit = self.search(&self.map.deposits, self.spill(spill)).at;
                known.insert(place, (spill, deposit));
                deposit
            }
        }
    }

    fn place(&self, fraction: Vec2) -> Vec2 {
        self.min + fraction * self.size
    }

    fn realm(&self, spots: &Spots, last: &Cell<Realm>, at: Vec2) -> Realm {
        let realm = last.get();
        if (at - realm.center).length_squared() < realm.squared {
            return realm;
        }
        let realm = self.search(spots, at);
        last.set(realm);
        realm
    }

    /// Finds the nearest spot, the first at equal distance, and the radius in which it stays the nearest.
    fn search(&self, spots: &Spots, at: Vec2) -> Realm {
        const ROUNDING_M: f32 = 0.01;
        let fraction = (at - self.min) / self.size;
        let mut around = 1.0;
        loop {
            let block = spots.block(fraction, around);
            let [nearest, next] = self.two_nearest(spots, &block, at);
            // No spot outside the block is nearer than the edge of the block.
            let sure_m = if block.is_all(spots.side) {
                f32::INFINITY
            } else {
                spots.to_edge(&block, fraction, self.size).max(0.0)
            };
            if nearest.squared <= sure_m * sure_m {
                let next_m = next.squared.sqrt().min(sure_m);
                let radius_m = (next_m - nearest.squared.sqrt()) / 2.0 - ROUNDING_M;
                return Realm {
                    center: at,
                    squared: radius_m.max(0.0) * radius_m.max(0.0),
                    spot: nearest.spot,
                    at: self.spot(spots, nearest.spot),
                };
            }
            around *= 2.0;
        }
    }

    fn spot(&self, spots: &Spots, spot: u32) -> Vec2 {
        self.place(spots.fractions[spot as usize])
    }

    /// Returns the two nearest spots of a block. Missing spots have an infinite distance.
    fn two_nearest(&self, spots: &Spots, block: &Block, at: Vec2) -> [Candidate; 2] {
        let missing = Candidate {
            squared: f32::INFINITY,
            spot: 0,
        };
        let mut two = [missing; 2];
        for &(fraction, spot) in spots.within(block) {
            let squared = (self.place(fraction) - at).length_squared();
            let candidate = Candidate { squared, spot };
            if candidate.is_before(&two[0]) {
                two = [candidate, two[0]];
            } else if candidate.is_before(&two[1]) {
                two[1] = candidate;
            }
        }
        two
    }
}

#[derive(Clone, Copy)]
struct Candidate {
    squared: f32,
    spot: u32,
}

impl Candidate {
    fn is_before(&self, other: &Self) -> bool {
        self.squared < other.squared || (self.squared == other.squared && self.spot < other.spot)
    }
}

/// A rectangle of grid cells, with inclusive corners.
struct Block {
    low: (usize, usize),
    high: (usize, usize),
}

impl Block {
    fn is_all(&self, side: usize) -> bool {
        self.low == (0, 0) && self.high == (side - 1, side - 1)
    }
}

/// Spots as fractions of the border, with a grid that finds near spots.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spots {
    fractions: Vec<Vec2>,
    side: usize,
    /// The spots with their numbers, sorted by cell and row. Neighbor cells of a row are adjacent.
    by_cell: Vec<(Vec2, u32)>,
    /// The index in `by_cell` of the first spot of each cell, and the total number of spots.
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
        let mut by_cell: Vec<(Vec2, u32)> = fractions.iter().copied().zip(0..).collect();
        by_cell.sort_by_key(|&(fraction, _)| cell(fraction));
        let begin = |of: usize| by_cell.partition_point(|&(at, _)| cell(at) < of) as u32;
        Self {
            begins: (0..=side * side).map(begin).collect(),
            fractions,
            side,
            by_cell,
        }
    }

    fn block(&self, fraction: Vec2, around: f32) -> Block {
        let around = Vec2::splat(around / self.side as f32);
        let (low, high) = (fraction - around, fraction + around);
        Block {
            low: (along(low.x, self.side), along(low.y, self.side)),
            high: (along(high.x, self.side), along(high.y, self.side)),
        }
    }

    fn within(&self, block: &Block) -> impl Iterator<Item = &(Vec2, u32)> + '_ {
        let (low, high) = (block.low, block.high);
        (low.1..=high.1).flat_map(move |y| {
            let begin = self.begins[y * self.side + low.0];
            let end = self.begins[y * self.side + high.0 + 1];
            &self.by_cell[begin as usize..end as usize]
        })
    }

    /// Returns the distance from a place to the outside of the block, m. Negative if the place lies outside.
    fn to_edge(&self, block: &Block, fraction: Vec2, size: Vec2) -> f32 {
        let cells = fraction * self.side as f32;
        let beyond = |low: usize, high: usize, at: f32| {
            // No spot lies beyond the border.
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

/// Returns the cell of a fraction along one side. Fractions outside the border give the nearest cell.
fn along(share: f32, side: usize) -> usize {
    ((share * side as f32) as usize).min(side - 1)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use crate::waste::data::default_scenario;

    use super::*;
    use robot_agent::body::goal::length;

    fn map(spots: &[(f32, f32)]) -> Map {
        let mut scenario = default_scenario();
        let spill = |&(x_fraction, y_fraction): &(f32, f32)| Spill {
            x_fraction,
            y_fraction,
            ..Spill::default()
        };
        WasteSection::of_mut(&mut scenario).spills = spots.iter().map(spill).collect();
        Map::of(&scenario)
    }

    fn border(width: f32) -> Locations {
        Locations {
            min: Vec2::ZERO,
            max: Vec2::new(width, 9.0),
        }
    }

    #[test]
    fn the_first_of_two_equally_near_spills_has_the_work() {
        let map = map(&[(0.75, 0.5), (0.25, 0.5)]);
        let border = border(12.0);
        let realms = Realms::default();
        let places = map.places(&border, &realms);
        assert_eq!(places.nearest_spill(Vec2::new(6.0, 1.0)), 0);
        assert_eq!(places.nearest_spill(Vec2::new(5.9, 1.0)), 1);
        assert_eq!(places.spill(1), Vec2::new(3.0, 4.5));
    }

    proptest! {
        /// Compares with a linear search, also outside the border and for crowded spots, with several queries on one
        /// cache.
        #[test]
        fn the_search_finds_the_nearest_spot(
            spots in prop::collection::vec((0.0..1.0_f32, 0.0..1.0_f32), 1..200),
            crowd in 0.05..1.0_f32,
            size in (1.0..900.0_f32, 1.0..900.0_f32),
            queries in prop::collection::vec((-0.2..1.2_f32, -0.2..1.2_f32, -9.0..9.0_f32, -9.0..9.0_f32), 1..8),
        ) {
            let spots: Vec<_> = spots.iter().map(|(x, y)| (x * crowd, y)).map(|(x, y)| (x, *y)).collect();
            let map = map(&spots);
            let border = Locations {
                min: Vec2::new(3.0, -2.0),
                max: Vec2::new(3.0 + size.0, size.1 - 2.0),
            };
            let realms = Realms::default();
            let places = map.places(&border, &realms);
            for (x, y, x_m, y_m) in queries {
                let at = border.min + Vec2::new(x, y) * Vec2::new(size.0, size.1);
                for at in [at, at + Vec2::new(x_m, y_m) / 10.0, at + Vec2::new(x_m, y_m)] {
                    let found = places.nearest_spill(at);
                    let fresh = map.places(&border, &Realms::default()).nearest_spill(at);
                    prop_assert_eq!(found, fresh, "the cache does not change the result");
                    let deposit = places.nearest_deposit(places.spill(found));
                    prop_assert_eq!(places.deposit_of(found), deposit);
                    let found = length(places.spill(found) - at);
                    for spill in 0..spots.len() as u32 {
                        // Rounding may exchange two spots at nearly equal distances.
                        prop_assert!(found <= length(places.spill(spill) - at) * (1.0 + 1e-6));
                    }
                }
            }
        }
    }

    #[test]
    fn with_another_border_other_spots_are_near() {
        let map = map(&[(0.25, 0.5), (0.75, 0.5)]);
        let realms = Realms::default();
        for (width, nearest) in [(12.0, 1), (24.0, 0), (12.0, 1)] {
            let border = border(width);
            let places = map.places(&border, &realms);
            assert_eq!(places.nearest_spill(Vec2::new(8.0, 4.5)), nearest);
            let fresh = map.places(&border, &Realms::default()).deposit_of(nearest);
            assert_eq!(places.deposit_of(nearest), fresh);
        }
    }
}
