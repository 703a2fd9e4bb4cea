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
pub struct Grid {
    cell_m: f32,
    cells: UVec2,
    /// First id of each cell's list.
    first: Vec<u32>,
    /// By id.
    entries: Vec<Entry>,
}

/// Something that lies somewhere. The place is here, too, so that a search need not look elsewhere for what is not near.
#[derive(Clone, Copy, Debug)]
struct Entry {
    at: Vec2,
    cell: u32,
    /// The id that follows in its cell's list.
    next: u32,
}

impl Grid {
    /// An empty grid over a room for so many ids, and for searches that reach so far: of cells that hold one on average, but are
    /// so wide that few searches look into more than two by two.
    #[must_use]
    pub fn new(size: Vec2, reach_m: f32, count: usize) -> Self {
        let area = size.x * size.y;
        let least = (area / MOST_CELLS).max(area / count.max(1) as f32);
        // A room that is very narrow has a small area and many cells in a row.
        let narrow_m = (size.x + size.y) / MOST_CELLS;
        let cell_m = (2.0 * reach_m).max(least.sqrt()).max(narrow_m);
        let cells = (size / cell_m).ceil().as_uvec2().max(UVec2::ONE);
        Self {
            cell_m,
            cells,
            first: vec![NONE; cells.element_product() as usize],
            entries: Vec::new(),
        }
    }

    /// Puts in an id that is not there.
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

    /// Takes out an id that is there.
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

    /// What is there is elsewhere now.
    pub fn relocate(&mut self, id: usize, to: Vec2) {
        if self.entries[id].cell == self.cell(to) {
            self.entries[id].at = to;
        } else {
            self.remove(id);
            self.insert(id, to);
        }
    }

    /// Everything within reach of a point in x and in y, with its place.
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

    /// Outside the room, those of the nearest cell.
    fn coordinates(&self, at: Vec2) -> UVec2 {
        // Casts saturate.
        (at / self.cell_m).as_uvec2().min(self.cells - UVec2::ONE)
    }
}

/// What is near a point, cell by cell. By hand, for it is what a step of the world spends its time in: chained iterators take
/// several times as long, and [`Iterator::next`] longer than [`Iterator::fold`].
#[derive(Clone, Debug)]
pub struct Near<'a> {
    grid: &'a Grid,
    at: Vec2,
    reach_m: f32,
    /// The next one of the list at hand.
    id: u32,
    /// The cell whose list comes after that.
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
    /// The cell at hand comes next.
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

    fn point() -> impl Strategy<Value = Vec2> {
        (-1.0..8.0_f32, -1.0..4.0_f32).prop_map(|(x, y)| Vec2::new(x, y))
    }

    proptest! {
        /// Against a list of everything: nothing within reach is missed, nothing comes twice, and what is gone is gone.
        #[test]
        fn finds_what_a_look_at_everything_finds(
            moves in prop::collection::vec((0..12_usize, prop::option::of(point())), 0..80),
            looks in prop::collection::vec((point(), 0.0..3.0_f32), 1..8),
            cell_m in 0.1..5.0_f32,
            count in 0..50_usize,
        ) {
            let mut grid = Grid::new(SIZE, cell_m, count);
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
    fn those_of_a_cell_come_by_id_whatever_came_first() {
        let at = Vec2::new(0.5, 0.5);
        for ids in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut grid = Grid::new(SIZE, 0.5, 3);
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
        let grid = Grid::new(Vec2::splat(1e6), 1.0, usize::MAX);
        assert!(grid.first.len() < 1_100_000);
    }
}
