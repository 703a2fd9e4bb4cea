//! The search for waste of which nobody knows: back and forth over a spill's part of the room, row by row, as a field is mown.

use alliance_proto::mission::waste::Locations;
use glam::Vec2;

use super::map::Places;
use super::sight::Sight;
use super::views::AT_POINT_M;
use crate::waste::data::sweep_cells;
use robot_agent::body::goal::is_within;

/// Most cells that are passed over in a step: a border that somebody told of may be of any size.
const PASSED_MOST: u32 = 1000;

/// How far a robot has got with it. It keeps that when its set hibernates, and goes on from there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sweep {
    /// Cells that are done.
    done: u64,
}

impl Sweep {
    /// Where to go next; `None` when all of it has been looked over.
    pub fn next(
        &mut self,
        spill: u16,
        sight: &Sight,
        sight_m: f32,
        places: &Places,
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
            self.pass();
        }
        Some(sight.position)
    }

    /// There is no way to where it was to go next.
    pub fn pass(&mut self) {
        self.done += 1;
    }
}
