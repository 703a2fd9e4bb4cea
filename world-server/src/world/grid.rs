//! A uniform grid over the room that finds the entries near a point.
//!
//! The lists of all cells share one array, so a moving entry allocates no memory. Results depend only on places and ids.

use glam::{UVec2, Vec2};
use prefetch::prefetch;
use scenario::Room;

/// The end mark of a list.
const NONE: u32 = u32::MAX;

/// The largest number of cells. A huge room has larger cells.
const MOST_CELLS: f32 = 1_048_576.0;

/// The largest number of cells whose lists are requested from memory. Searches read few cells of a larger room.
const FEW_CELLS: usize = 64;

#[derive(Clone, Debug)]
pub struct Grid {
    /// The lower left corner of the first cell, m.
    low: Vec2,
    cell_m: f32,
    cells: UVec2,
    /// The first id of each cell's list.
    first: Vec<u32>,
    /// The entries, indexed by id.
    entries: Vec<Entry>,
}

/// An entry of the grid. It contains the place, so that a search reads no other memory for distant entries.
#[derive(Clone, Copy, Debug)]
struct Entry {
    at: Vec2,
    cell: u32,
    /// The next id in the list of the cell.
    next: u32,
}

impl Grid {
    /// Creates an empty grid for `count` ids and searches up to `reach_m`. A cell holds one entry on average, and few searches
    /// need more than two by two cells.
    #[must_use]
    pub fn new(room: &Room, reach_m: f32, count: usize) -> Self {
        let size = room.size();
        let area = size.x * size.y;
        let least = (area / MOST_CELLS).max(area / count.max(1) as f32);
        // A very narrow room has a small area and many cells in a row.
        let narrow_m = (size.x + size.y) / MOST_CELLS;
        let cell_m = (2.0 * reach_m).max(least.sqrt()).max(narrow_m);
        let cells = (size / cell_m).ceil().as_uvec2().max(UVec2::ONE);
        Self {
            low: room.low(),
            cell_m,
            cells,
            first: vec![NONE; cells.element_product() as usize],
            entries: Vec::new(),
        }
    }

    /// Requests the memory of the lists, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self) {
        prefetch(&*self.entries);
        if self.first.len() <= FEW_CELLS {
            prefetch(&*self.first);
        }
    }

    /// Inserts an id, which must be new.
    pub fn insert(&mut self, id: usize, at: Vec2) {
        if self.entries.len() <= id {
            let nowhere = Entry {
                at,
                cell: NONE,
                next: NONE,
            };
            self.entries.resize(id + 1, nowhere);
        }
        let cell = self.cell(at);
        let id = id as u32;
        let first = &mut self.first[cell as usize];
        let next = if *first > id {
            std::mem::replace(first, id)
        } else {
            let mut before = *first as usize;
            while self.entries[before].next < id {
                before = self.entries[before].next as usize;
            }
            std::mem::replace(&mut self.entries[before].next, id)
        };
        self.entries[id as usize] = Entry { at, cell, next };
    }

    /// Removes an id, which must exist.
    pub fn remove(&mut self, id: usize) {
        let Entry {
            cell, next: after, ..
        } = self.entries[id];
        let id = id as u32;
        let mut before = self.first[cell as usize];
        if before == id {
            self.first[cell as usize] = after;
            return;
        }
        while before != NONE {
            let link = &mut self.entries[before as usize].next;
            if *link == id {
                *link = after;
                return;
            }
            before = *link;
        }
    }

    /// Changes the place of an id, which must exist.
    pub fn relocate(&mut self, id: usize, to: Vec2) {
        if self.entries[id].cell == self.cell(to) {
            self.entries[id].at = to;
        } else {
            self.remove(id);
            self.insert(id, to);
        }
    }

    /// Returns the entries within reach of a point in x and in y, with their places.
    #[inline]
    #[must_use]
    pub fn near(&self, at: Vec2, reach_m: f32) -> Near<'_> {
        let (low, high) = (
            self.coordinates(at - reach_m),
            self.coordinates(at + reach_m),
        );
        Near {
            grid: self,
            at,
            reach_m,
            id: NONE,
            cell: low,
            low_x: low.x,
            high,
        }
    }

    fn cell(&self, at: Vec2) -> u32 {
        let cell = self.coordinates(at);
        cell.y * self.cells.x + cell.x
    }

    /// Returns the cell of a point; outside the room, the nearest cell.
    fn coordinates(&self, at: Vec2) -> UVec2 {
        // Casts saturate.
        ((at - self.low) / self.cell_m)
            .as_uvec2()
            .min(self.cells - UVec2::ONE)
    }
}

/// An iterator over the entries near a point. It is written by hand, because the world spends most of its time here. Chained
/// iterators are several times slower, and [`Iterator::next`] is slower than [`Iterator::fold`].
#[derive(Clone, Debug)]
pub struct Near<'a> {
    grid: &'a Grid,
    at: Vec2,
    reach_m: f32,
    /// The next id in the current list.
    id: u32,
    /// The cell of the following list.
    cell: UVec2,
    low_x: u32,
    high: UVec2,
}

impl Iterator for Near<'_> {
    type Item = (usize, Vec2);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        loop {
            while self.id == NONE {
                if self.cell.y > self.high.y {
                    return None;
                }
                self.enter_cell();
            }
            let id = self.id as usize;
            let entry = &self.grid.entries[id];
            self.id = entry.next;
            if self.reaches(entry) {
                return Some((id, entry.at));
            }
        }
    }

    #[inline]
    fn fold<T, F: FnMut(T, Self::Item) -> T>(mut self, first: T, mut join: F) -> T {
        let mut joined = first;
        loop {
            while self.id != NONE {
                let id = self.id as usize;
                let entry = &self.grid.entries[id];
                self.id = entry.next;
                if self.reaches(entry) {
                    joined = join(joined, (id, entry.at));
                }
            }
            if self.cell.y > self.high.y {
                return joined;
            }
            self.enter_cell();
        }
    }
}

impl Near<'_> {
    #[inline(always)]
    fn enter_cell(&mut self) {
        self.id = self.grid.first[(self.cell.y * self.grid.cells.x + self.cell.x) as usize];
        self.cell.x += 1;
        if self.cell.x > self.high.x {
            self.cell = UVec2::new(self.low_x, self.cell.y + 1);
        }
    }

    #[inline(always)]
    fn reaches(&self, entry: &Entry) -> bool {
        let apart = (entry.at - self.at).abs();
        (apart.x <= self.reach_m) & (apart.y <= self.reach_m)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    const SIZE: Vec2 = Vec2::new(7.0, 3.0);
    const ROOM: Room = Room::of_size(SIZE.x, SIZE.y);

    fn point() -> impl Strategy<Value = Vec2> {
        (-1.0..8.0_f32, -1.0..4.0_f32).prop_map(|(x, y)| Vec2::new(x, y))
    }

    proptest! {
        /// Compares the grid with a full list: it finds each entry within reach exactly once, and no removed entry.
        #[test]
        fn finds_the_same_entries_as_a_full_search(
            moves in prop::collection::vec((0..12_usize, prop::option::of(point())), 0..80),
            looks in prop::collection::vec((point(), 0.0..3.0_f32), 1..8),
            cell_m in 0.1..5.0_f32,
            count in 0..50_usize,
        ) {
            let mut grid = Grid::new(&ROOM, cell_m, count);
            let mut there: [Option<Vec2>; 12] = [None; 12];
            for (id, to) in moves {
                match (there[id], to) {
                    (None, Some(to)) => grid.insert(id, to),
                    (Some(_), None) => grid.remove(id),
                    (Some(_), Some(to)) => grid.relocate(id, to),
                    (None, None) => {}
                }
                there[id] = to;
            }
            for (at, reach_m) in looks {
                let mut one_by_one = grid.near(at, reach_m);
                let mut next = || one_by_one.next();
                grid.near(at, reach_m).for_each(|near| assert_eq!(next(), Some(near)));
                prop_assert_eq!(next(), None);
                let (found, places): (Vec<usize>, Vec<Vec2>) = grid.near(at, reach_m).unzip();
                prop_assert!(found.iter().zip(places).all(|(id, place)| there[*id] == Some(place)));
                let distinct: BTreeSet<usize> = found.iter().copied().collect();
                prop_assert_eq!(found.len(), distinct.len());
                for (id, place) in there.iter().enumerate() {
                    let Some(place) = place else {
                        prop_assert!(!distinct.contains(&id));
                        continue;
                    };
                    let is_near = (*place - at).abs().max_element() <= reach_m;
                    prop_assert_eq!(distinct.contains(&id), is_near, "{} at {} from {}", id, place, at);
                }
            }
        }
    }

    #[test]
    fn entries_of_a_cell_are_ordered_by_id() {
        let at = Vec2::new(0.5, 0.5);
        for ids in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut grid = Grid::new(&ROOM, 0.5, 3);
            for id in ids {
                grid.insert(id, at);
            }
            assert_eq!(
                grid.near(at, 0.1).collect::<Vec<_>>(),
                [(0, at), (1, at), (2, at)]
            );
        }
    }

    #[test]
    fn a_huge_room_has_larger_cells() {
        let grid = Grid::new(&Room::of_size(1e6, 1e6), 1.0, usize::MAX);
        assert!(grid.first.len() < 1_100_000);
    }
}
