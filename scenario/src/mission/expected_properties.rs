//! Properties that every run of a mission must have, for analysis from outside.

use std::collections::HashMap;
use std::ops::Deref;

use glam::{IVec2, Vec2};

/// A circular area on the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// The center of the area, m.
    pub center: Vec2,
    /// The radius of the area, m.
    pub radius_m: f32,
}

impl Disc {
    /// Returns true if the area contains a point.
    #[must_use]
    pub fn contains(&self, point: Vec2) -> bool {
        point.distance(self.center) <= self.radius_m
    }
}

/// Circular areas, with a grid that finds those at a point: large missions have tens of thousands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Discs {
    all: Vec<Disc>,
    /// The side of a cell, m: the greatest diameter.
    cell_m: f32,
    /// The indexes of the areas whose bounding squares touch each cell.
    by_cell: HashMap<IVec2, Vec<u32>>,
}

impl Discs {
    /// Returns true if any area contains a point.
    #[must_use]
    pub fn contain(&self, point: Vec2) -> bool {
        let here = self.by_cell.get(&cell(point, self.cell_m));
        let mut here = here.into_iter().flatten();
        here.any(|index| self.all[*index as usize].contains(point))
    }
}

impl FromIterator<Disc> for Discs {
    fn from_iter<I: IntoIterator<Item = Disc>>(discs: I) -> Self {
        let all: Vec<Disc> = discs.into_iter().collect();
        let widest_m = all.iter().map(|disc| 2.0 * disc.radius_m);
        let cell_m = widest_m.fold(f32::MIN_POSITIVE, f32::max);
        let mut by_cell: HashMap<IVec2, Vec<u32>> = HashMap::new();
        for (disc, index) in all.iter().zip(0..) {
            let low = cell(disc.center - disc.radius_m, cell_m);
            let high = cell(disc.center + disc.radius_m, cell_m);
            for (x, y) in (low.x..=high.x).flat_map(|x| (low.y..=high.y).map(move |y| (x, y))) {
                by_cell.entry(IVec2::new(x, y)).or_default().push(index);
            }
        }
        Self {
            all,
            cell_m,
            by_cell,
        }
    }
}

impl Deref for Discs {
    type Target = [Disc];

    fn deref(&self) -> &[Disc] {
        &self.all
    }
}

fn cell(point: Vec2, cell_m: f32) -> IVec2 {
    (point / cell_m).floor().as_ivec2()
}

/// The properties of every run of a scenario, with or without faults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExpectedProperties {
    /// The number of items at the start. No item is lost, and only faults add items.
    pub items: usize,
    /// The areas that delivered items never leave.
    pub goals: Discs,
    /// The areas that robots must reach, besides the items, to finish the mission.
    pub targets: Discs,
    /// True if the mission ends whenever a sound robot can do all of it and can reach all remaining work.
    pub ends: bool,
}
