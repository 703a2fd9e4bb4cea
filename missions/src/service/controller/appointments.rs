//! Appointments: the points at which robots gather that have waited in vain at other points.
//!
//! The time is divided into rounds, which are the same for all robots. A round names one point with several slots, so that
//! robots need no messages to meet there. Each point has two rounds in a cycle of rounds. In the first, robots fill any slot
//! for which they have the skill. In the second, each slot is for one robot. Rounds of the next cycle last twice as long.

use std::collections::BTreeMap;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Catalog, Scenario, fill_slots};

use crate::service::data::Slots;

/// The rounds of a scenario.
#[derive(Debug)]
pub(super) struct Appointments {
    /// The points with several slots that the team can fill, in ascending order.
    points: Vec<u32>,
    /// The robots with each skill, by rank.
    able: BTreeMap<String, Vec<RobotId>>,
    /// The length of a round in the first cycle, at least 1 ms.
    round: SimTime,
}

/// A round, in which robots gather at one point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Round {
    /// The number of the cycle.
    pub cycle: u32,
    /// The number within the cycle: first the rounds with any slot, then those with one slot for each robot.
    number: u64,
}

/// The place at which a robot must be in a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Appointment {
    /// Any slot of a point.
    Point(u32),
    /// The slot of a point, as a task.
    Slot(u32, TaskId),
    /// Other points than this one, whose slots are for other robots.
    Elsewhere(u32),
}

impl Appointment {
    /// Returns whether the robot may fill the slot of a point.
    pub fn permits(self, point: u32, slot: TaskId) -> bool {
        match self {
            Self::Point(here) => here == point,
            Self::Slot(_, own) => own == slot,
            Self::Elsewhere(there) => there != point,
        }
    }

    /// Returns whether this is an appointment in a round of a point.
    pub fn concerns(self, point: u32) -> bool {
        let (Self::Point(of_round) | Self::Slot(of_round, _) | Self::Elsewhere(of_round)) = self;
        of_round == point
    }

    /// Returns whether the robot should be at a point.
    pub fn is_at(self, point: u32) -> bool {
        matches!(self, Self::Point(here) | Self::Slot(here, _) if here == point)
    }
}

impl Appointments {
    pub fn new(scenario: &Scenario, slots: &Slots, catalog: &Catalog, round: SimTime) -> Self {
        let unfillable: Vec<u32> = (slots.unfillable(scenario, catalog).into_iter())
            .map(|(point, _)| point)
            .collect();
        let several = slots.iter().filter(|(_, slots)| slots.len() > 1);
        let mut able: BTreeMap<String, Vec<RobotId>> = BTreeMap::new();
        for slot in slots.iter().flat_map(|(_, slots)| slots) {
            able.entry(slot.skill.clone()).or_insert_with(|| {
                let robots = scenario.robots.iter().zip((0..).map(RobotId));
                let robots =
                    robots.filter(|(robot, _)| robot.skill(&slot.skill).unwrap_or(1.0) > 0.0);
                robots.map(|(_, rank)| rank).collect()
            });
        }
        Self {
            points: several
                .map(|(point, _)| point)
                .filter(|point| !unfillable.contains(point))
                .collect(),
            able,
            round: SimTime(round.0.max(1)),
        }
    }

    /// Returns the round at a time; `None` if the team can fill no point with several slots.
    pub fn round(&self, now: SimTime) -> Option<Round> {
        let first_cycle = 2 * self.points.len() as u64 * self.round.0;
        // Cycle n begins at 2^n - 1 lengths of the first cycle.
        let cycle = (now.0.checked_div(first_cycle)? + 1).ilog2();
        let since = now.0 - first_cycle * ((1 << cycle) - 1);
        let number = since / self.length(cycle).0;
        Some(Round { cycle, number })
    }

    /// Returns the length of the rounds of a cycle.
    pub fn length(&self, cycle: u32) -> SimTime {
        SimTime(self.round.0 << cycle)
    }

    /// Returns those of some points, in ascending order, that have rounds.
    pub fn with_rounds(&self, points: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut points: Vec<u32> = points
            .filter(|point| self.points.binary_search(point).is_ok())
            .collect();
        points.sort_unstable();
        points.dedup();
        points
    }

    /// Returns the point of a round for a robot with these [points](Self::with_rounds): the one with the number of the
    /// round, or the next one, if `is_due` is true for it.
    pub fn point(&self, round: Round, own: &[u32], is_due: impl Fn(u32) -> bool) -> Option<u32> {
        let of_round = self.points[round.number as usize % self.points.len()];
        let first = own.partition_point(|point| *point < of_round);
        let mut in_order = own[first..].iter().chain(&own[..first]).copied();
        in_order.find(|point| is_due(*point))
    }

    /// Returns the place of a robot in a round whose point is known. The robots for the slots are drawn for each round, so
    /// that the same robots do not always gather in vain if one of them is lost.
    pub fn place(&self, round: Round, point: u32, slots: &Slots, robot: RobotId) -> Appointment {
        if round.number < self.points.len() as u64 {
            return Appointment::Point(point);
        }
        let of_point = slots.of_point(point);
        let able = |slot: usize| self.able[&of_point[slot].skill].as_slice();
        let mut robots: Vec<RobotId> = (0..of_point.len())
            .flat_map(|slot| able(slot).iter().copied())
            .collect();
        robots.sort_unstable();
        robots.dedup();
        let mut chance = ChaCha8Rng::seed_from_u64((u64::from(round.cycle) << 48) | round.number);
        robots.sort_by_cached_key(|_| chance.random::<u64>());
        let filled = fill_slots(
            of_point.len(),
            robots.into_iter().map(|robot| (robot, None)),
            |robot, slot| able(slot).binary_search(&robot).is_ok(),
        );
        match filled.iter().position(|member| *member == Some(robot)) {
            Some(slot) => Appointment::Slot(point, of_point[slot].task),
            None => Appointment::Elsewhere(point),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn appointments(points: u32) -> Appointments {
        Appointments {
            points: (0..points).collect(),
            able: BTreeMap::new(),
            round: SimTime(1000),
        }
    }

    /// With three points, the first cycle has six rounds of 1 s, the second six of 2 s, and the third six of 4 s.
    #[test]
    fn rounds_of_the_next_cycle_are_twice_as_long() {
        let at = |now_ms: u64| {
            let round = appointments(3).round(SimTime(now_ms)).unwrap();
            (round.cycle, round.number)
        };
        let expected = [
            (0, (0, 0)),
            (999, (0, 0)),
            (1000, (0, 1)),
            (5999, (0, 5)),
            (6000, (1, 0)),
            (7999, (1, 0)),
            (17_999, (1, 5)),
            (18_000, (2, 0)),
            (41_999, (2, 5)),
            (42_000, (3, 0)),
        ];
        for (now_ms, round) in expected {
            assert_eq!(at(now_ms), round, "{now_ms}");
        }
        assert_eq!(appointments(0).round(SimTime(5)), None);
    }

    #[test]
    fn a_round_names_the_next_point_that_is_due() {
        let appointments = appointments(4);
        let of_round = |number, due: &[u32]| {
            let round = Round { cycle: 0, number };
            appointments.point(round, due, |_| true)
        };
        assert_eq!(of_round(2, &[0, 1, 2, 3]), Some(2));
        assert_eq!(
            of_round(6, &[0, 1, 2, 3]),
            Some(2),
            "the second round of a point"
        );
        assert_eq!(of_round(2, &[0, 1]), Some(0));
        assert_eq!(of_round(2, &[]), None);
        let round = Round {
            cycle: 0,
            number: 2,
        };
        let point = appointments.point(round, &[0, 2, 3], |point| point != 2);
        assert_eq!(point, Some(3), "p2 is not due");
    }

    #[test]
    fn other_points_have_no_rounds() {
        let points = [7, 1, 0, 1].into_iter();
        assert_eq!(appointments(3).with_rounds(points), [0, 1]);
    }
}
