//! Finds what lies near a point without looking at everything: a uniform grid over the room.
//!
//! Each cell has its list of ids in ascending order, threaded through one array, so that nothing is allocated when something
//! moves, and what is found comes in an order that depends on nothing but places and ids.

use glam::{UVec2, Vec2};

/// The end of a list.
const NONE: u32 = u32::MAX;

/// Most cells: a huge room has larger ones.
const MOST_CELLS: f32 = 1_048_576.0;

/// Ids by where they are.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    cell_m: f32,
    cells: UVec2,
    /// First id of each cell's list.
    first: Vec<u32>,
    /// The id that follows each id in its list.
    next: Vec<u32>,
}

impl Grid {
    /// An empty grid over a room. Best when most searches reach as far as a cell is wide.
    pub fn new(size: Vec2, reach_m: f32) -> Self {
        let cell_m = reach_m.max((size.x * size.y / MOST_CELLS).sqrt());
        let cells = (size / cell_m).ceil().as_uvec2().max(UVec2::ONE);
        Self {
            cell_m,
            cells,
            first: vec![NONE; cells.element_product() as usize],
            next: Vec::new(),
        }
    }

    /// Puts in an id that is not there.
    pub fn insert(&mut self, id: usize, at: Vec2) {
        if self.next.len() <= id {
            self.next.resize(id + 1, NONE);
        }
        let cell = self.cell(at);
        let id = id as u32;
        let after = self.first[cell];
        if after > id {
            self.next[id as usize] = after;
            self.first[cell] = id;
            return;
        }
        let mut before = after as usize;
        while self.next[before] < id {
            before = self.next[before] as usize;
        }
        self.next[id as usize] = self.next[before];
        self.next[before] = id;
    }

    /// Takes out an id that was put in there.
    pub fn remove(&mut self, id: usize, at: Vec2) {
        let cell = self.cell(at);
        let (id, after) = (id as u32, self.next[id]);
        let mut before = self.first[cell];
        if before == id {
            self.first[cell] = after;
            return;
        }
        while before != NONE {
            let link = &mut self.next[before as usize];
            if *link == id {
                *link = after;
                return;
            }
            before = *link;
        }
    }

    /// What was there is elsewhere.
    pub fn relocate(&mut self, id: usize, from: Vec2, to: Vec2) {
        if self.cell(from) != self.cell(to) {
            self.remove(id, from);
            self.insert(id, to);
        }
    }

    /// Everything within reach of a point, and some that is not.
    pub fn near(&self, at: Vec2, reach_m: f32) -> Near<'_> {
        let (low, high) = (
            self.coordinates(at - reach_m),
            self.coordinates(at + reach_m),
        );
        Near {
            grid: self,
            id: NONE,
            cell: low,
            low_x: low.x,
            high,
        }
    }

    fn cell(&self, at: Vec2) -> usize {
        let cell = self.coordinates(at);
        (cell.y * self.cells.x + cell.x) as usize
    }

    /// Outside the room, those of the nearest cell.
    fn coordinates(&self, at: Vec2) -> UVec2 {
        // Casts saturate.
        (at / self.cell_m).as_uvec2().min(self.cells - UVec2::ONE)
    }
}

/// What is near a point, cell by cell. By hand, for it is what a step of the world spends its time in: chained iterators take
/// several times as long.
#[derive(Clone, Debug)]
pub(super) struct Near<'a> {
    grid: &'a Grid,
    /// The next one of the list at hand.
    id: u32,
    /// The cell whose list comes after that.
    cell: UVec2,
    low_x: u32,
    high: UVec2,
}

impl Iterator for Near<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        while self.id == NONE {
            if self.cell.y > self.high.y {
                return None;
            }
            self.id = self.grid.first[(self.cell.y * self.grid.cells.x + self.cell.x) as usize];
            self.cell.x += 1;
            if self.cell.x > self.high.x {
                self.cell = UVec2::new(self.low_x, self.cell.y + 1);
            }
        }
        let id = self.id as usize;
        self.id = self.grid.next[id];
        Some(id)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    const SIZE: Vec2 = Vec2::new(7.0, 3.0);

    fn point() -> impl Strategy<Value = Vec2> {
        (-1.0..8.0_f32, -1.0..4.0_f32).prop_map(|(x, y)| Vec2::new(x, y))
    }

    proptest! {
        /// Against a list of everything: nothing within reach is missed, nothing comes twice, and what is gone is gone.
        #[test]
        fn finds_what_a_look_at_everything_finds(
            moves in prop::collection::vec((0..12_usize, prop::option::of(point())), 0..80),
            looks in prop::collection::vec((point(), 0.0..3.0_f32), 1..8),
            cell_m in 0.3..9.0_f32,
        ) {
            let mut grid = Grid::new(SIZE, cell_m);
            let mut there: [Option<Vec2>; 12] = [None; 12];
            for (id, to) in moves {
                match (there[id], to) {
                    (None, Some(to)) => grid.insert(id, to),
                    (Some(from), None) => grid.remove(id, from),
                    (Some(from), Some(to)) => grid.relocate(id, from, to),
                    (None, None) => {}
                }
                there[id] = to;
            }
            for (at, reach_m) in looks {
                let found: Vec<usize> = grid.near(at, reach_m).collect();
                let distinct: BTreeSet<usize> = found.iter().copied().collect();
                prop_assert_eq!(found.len(), distinct.len());
                for (id, place) in there.iter().enumerate() {
                    let Some(place) = place else {
                        prop_assert!(!distinct.contains(&id));
                        continue;
                    };
                    if (*place - at).abs().max_element() <= reach_m {
                        prop_assert!(distinct.contains(&id), "{id} at {place} from {at}");
                    }
                }
            }
        }
    }

    #[test]
    fn those_of_a_cell_come_by_id_whatever_came_first() {
        let at = Vec2::new(0.5, 0.5);
        for ids in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut grid = Grid::new(SIZE, 1.0);
            for id in ids {
                grid.insert(id, at);
            }
            assert_eq!(grid.near(at, 0.1).collect::<Vec<_>>(), [0, 1, 2]);
        }
    }

    #[test]
    fn a_huge_room_has_larger_cells() {
        let grid = Grid::new(Vec2::splat(1e6), 1.0);
        assert!(grid.first.len() < 1_100_000);
    }
}
