//! The robots within radio range of each other.

use glam::Vec2;
use scenario::Room;
use scenario::ids::RobotId;

use super::Floor;
use super::grid::Grid;
use crate::barrier::RadioReach;

/// The largest relative rounding error of a distance.
const ROUNDING: f32 = 1e-5;

/// The positions of all robots, for radios with a limited range.
#[derive(Clone, Debug)]
pub(super) struct RadioRange {
    range_m: f32,
    /// The ranks of the robots, by their centers. It includes robots without a body, because their agents may broadcast.
    places: Grid,
}

impl RadioRange {
    /// Requests the memory of the index, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self) {
        self.places.prefetch();
    }

    pub fn new(room: &Room, range_m: f32, places: impl ExactSizeIterator<Item = Vec2>) -> Self {
        let mut grid = Grid::new(room, range_m, places.len());
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

/// Broadcasts reach every robot within the scenario's range, or every robot if there is no range.
impl RadioReach for Floor {
    fn for_each_receiver(&self, sender: RobotId, mut receive: impl FnMut(RobotId)) {
        let Some(range) = &self.range else {
            let ranks = 0..self.robots.len() as u32;
            return ranks.map(RobotId).for_each(receive);
        };
        let at = self.robots[sender.index()].position();
        // The bounds decide most cases without a square root.
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
                receive(RobotId(rank as u32));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use scenario::testkit::default_scenario;
    use std::collections::BTreeSet;

    use proptest::prelude::*;
    use scenario::{Radio, Robot, Scenario, Setup, Start};

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
            radio: Radio {
                range_m,
                ..Radio::default()
            },
            robots: places.iter().enumerate().map(robot).collect(),
            ..default_scenario()
        };
        // The robots may overlap.
        scenario.body.robot_penetrability = 1.0;
        World::new(&Setup::resolve(scenario, 1, None).unwrap().setup, DRILL)
    }

    fn receivers(world: &World, sender: u32) -> BTreeSet<RobotId> {
        let mut receivers = Vec::new();
        world.for_each_receiver(RobotId(sender), |receiver| receivers.push(receiver));
        let distinct: BTreeSet<RobotId> = receivers.iter().copied().collect();
        assert_eq!(receivers.len(), distinct.len());
        distinct
    }

    #[test]
    fn without_a_range_all_robots_receive() {
        let world = world(None, &[(1.0, 1.0), (11.0, 8.0), (6.0, 4.0)]);
        assert_eq!(receivers(&world, 0).len(), 3);
    }

    proptest! {
        /// Compares the result with the distances of all robots, also after some robots were moved.
        #[test]
        fn only_robots_in_range_receive(
            places in prop::collection::vec((0.5..11.5_f32, 0.5..8.5_f32), 1..20),
            moves in prop::collection::vec((0..20_u32, 0.5..11.5_f32, 0.5..8.5_f32), 0..10),
            range_m in 0.5..15.0_f32,
        ) {
            let mut world = world(Some(range_m), &places);
            let ranks = 0..places.len() as u32;
            for (rank, x, y) in moves {
                if ranks.contains(&rank) {
                    world.move_robot(RobotId(rank), Vec2::new(x, y), None).unwrap();
                }
            }
            for sender in ranks.clone() {
                let at = |rank: u32| world.pose(RobotId(rank)).position;
                let near = ranks.clone().filter(|&rank| at(rank).distance(at(sender)) <= range_m);
                prop_assert_eq!(receivers(&world, sender), near.map(RobotId).collect());
            }
        }
    }
}
