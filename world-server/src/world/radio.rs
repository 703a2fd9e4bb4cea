//! Who is in range of whom.

use alliance_proto::ids::RobotId;
use glam::Vec2;

use super::Floor;
use super::grid::Grid;
use crate::barrier::Air;

/// What rounding makes of a distance at most, by share.
const ROUNDING: f32 = 1e-5;

/// The robots' places, where radios have a range.
#[derive(Clone, Debug)]
pub(super) struct RadioRange {
    range_m: f32,
    /// Ranks, by their centers; also of robots that have no body, for their agents may speak.
    places: Grid,
}

impl RadioRange {
    pub fn new(size: Vec2, range_m: f32, places: impl ExactSizeIterator<Item = Vec2>) -> Self {
        let mut grid = Grid::new(size, range_m, places.len());
        for (rank, place) in places.enumerate() {
            grid.insert(rank, place);
        }
        Self {
            range_m,
            places: grid,
        }
    }

    pub fn relocate(&mut self, rank: usize, to: Vec2) {
        self.places.relocate(rank, to);
    }
}

/// All robots hear each other, but for those that are farther apart than the scenario's range.
impl Air for Floor {
    fn for_each_hearer(&self, sender: RobotId, mut hear: impl FnMut(RobotId)) {
        let Some(range) = &self.range else {
            let ranks = 0..self.robots.len() as u16;
            return ranks.map(RobotId).for_each(hear);
        };
        let at = self.robots[sender.index()].position();
        // Most are clearly nearer, or clearly not: without a root.
        let (least, most) = (
            range.range_m * (1.0 - ROUNDING),
            range.range_m * (1.0 + ROUNDING),
        );
        let near = range.places.near(at, range.range_m);
        near.for_each(|(rank, place)| {
            let squared = place.distance_squared(at);
            if squared < least * least
                || (squared <= most * most && place.distance(at) <= range.range_m)
            {
                hear(RobotId(rank as u16));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use alliance_proto::testkit::default_scenario;
    use std::collections::BTreeSet;

    use alliance_proto::scenario::{Radio, Robot, Scenario, Setup, Start};
    use proptest::prelude::*;

    use super::*;
    use crate::drill::DRILL;
    use crate::world::World;

    fn world(range_m: Option<f32>, places: &[(f32, f32)]) -> World {
        let robot = |(rank, &(x_m, y_m)): (usize, &(f32, f32))| Robot {
            name: format!("r{rank}"),
            start: Some(Start {
                x_m,
                y_m,
                heading_deg: 0.0,
            }),
            ..Robot::default()
        };
        let mut scenario = Scenario {
            radio: Radio { range_m },
            robots: places.iter().enumerate().map(robot).collect(),
            ..default_scenario()
        };
        // They may stand in each other.
        scenario.body.robot_penetrability = 1.0;
        World::new(&Setup::resolve(scenario, 1, None).unwrap().setup, DRILL)
    }

    fn hearers(world: &World, sender: u16) -> BTreeSet<RobotId> {
        let mut hearers = Vec::new();
        world.for_each_hearer(RobotId(sender), |hearer| hearers.push(hearer));
        let distinct: BTreeSet<RobotId> = hearers.iter().copied().collect();
        assert_eq!(hearers.len(), distinct.len());
        distinct
    }

    #[test]
    fn without_a_range_all_hear_all() {
        let world = world(None, &[(1.0, 1.0), (11.0, 8.0), (6.0, 4.0)]);
        assert_eq!(hearers(&world, 0).len(), 3);
    }

    proptest! {
        /// Against the distances of all, also after some have been moved.
        #[test]
        fn those_within_the_range_hear_and_no_others(
            places in prop::collection::vec((0.5..11.5_f32, 0.5..8.5_f32), 1..20),
            moves in prop::collection::vec((0..20_u16, 0.5..11.5_f32, 0.5..8.5_f32), 0..10),
            range_m in 0.5..15.0_f32,
        ) {
            let mut world = world(Some(range_m), &places);
            let ranks = 0..places.len() as u16;
            for (rank, x, y) in moves {
                if ranks.contains(&rank) {
                    world.move_robot(RobotId(rank), Vec2::new(x, y), None).unwrap();
                }
            }
            for sender in ranks.clone() {
                let at = |rank: u16| world.pose(RobotId(rank)).position;
                let near = ranks.clone().filter(|&rank| at(rank).distance(at(sender)) <= range_m);
                prop_assert_eq!(hearers(&world, sender), near.map(RobotId).collect());
            }
        }
    }
}
