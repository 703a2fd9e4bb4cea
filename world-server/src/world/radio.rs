//! Who is in range of whom.

use alliance_proto::ids::RobotId;
use glam::Vec2;

use super::World;
use super::grid::Grid;
use crate::barrier::Air;

/// The robots' places, where radios have a range.
#[derive(Clone, Debug)]
pub(super) struct Range {
    range_m: f32,
    /// Ranks, by their centers; also of robots that have no body, for their agents may speak.
    places: Grid,
}

impl Range {
    pub fn new(size: Vec2, range_m: f32, places: impl Iterator<Item = Vec2>) -> Self {
        let mut grid = Grid::new(size, range_m);
        for (rank, place) in places.enumerate() {
            grid.insert(rank, place);
        }
        Self {
            range_m,
            places: grid,
        }
    }

    pub fn relocate(&mut self, rank: usize, from: Vec2, to: Vec2) {
        self.places.relocate(rank, from, to);
    }
}

/// All robots hear each other, but for those that are farther apart than the scenario's range.
impl Air for World {
    fn for_each_hearer(&self, sender: RobotId, mut hear: impl FnMut(RobotId)) {
        let Some(range) = &self.range else {
            let ranks = 0..self.robots.len() as u16;
            return ranks.map(RobotId).for_each(hear);
        };
        let at = self.robots[sender.index()].position();
        for rank in range.places.near(at, range.range_m) {
            if self.robots[rank].position().distance(at) <= range.range_m {
                hear(RobotId(rank as u16));
            }
        }
    }
}
