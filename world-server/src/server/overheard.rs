//! The broadcasts that the world has overheard, for the table of allocators' messages in a full log.
//!
//! The bus drops messages if a queue is full. A report whose broadcasts are incomplete therefore counts only after the
//! robot has sent its answer once more.

use std::collections::{BTreeMap, BTreeSet};

use proto::team::Broadcast;
use proto::tick::Report;
use scenario::ids::{Incarnation, RobotId, Tick};

/// The broadcasts of each robot's latest tick.
#[derive(Default)]
pub(super) struct Overheard(BTreeMap<RobotId, Arrived>);

#[derive(Default)]
struct Arrived {
    tick: Tick,
    incarnation: Incarnation,
    indices: BTreeSet<u16>,
    /// `true` if the robot has been asked for a repetition.
    again: bool,
}

/// The decision on a report by the broadcasts that it lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Completeness {
    Complete,
    /// Broadcasts are missing, and the robot can send them again.
    Repeat,
    /// Broadcasts are missing after a repetition.
    Missing,
}

impl Overheard {
    pub fn add(&mut self, broadcast: &Broadcast) {
        let arrived = self.of(broadcast.sender, broadcast.tick, broadcast.incarnation);
        if let Some(arrived) = arrived {
            arrived.indices.insert(broadcast.index);
        }
    }

    /// Compares a report with the broadcasts that arrived before it.
    pub fn check(&mut self, report: &Report) -> Completeness {
        let Some(arrived) = self.of(report.robot, report.tick, report.incarnation) else {
            return Completeness::Complete;
        };
        if (0..report.broadcasts).all(|index| arrived.indices.contains(&index)) {
            return Completeness::Complete;
        }
        match std::mem::replace(&mut arrived.again, true) {
            false => Completeness::Repeat,
            true => Completeness::Missing,
        }
    }

    /// Returns the entry of a robot's tick, which replaces an older one; `None` if a later one is known.
    fn of(&mut self, robot: RobotId, tick: Tick, incarnation: Incarnation) -> Option<&mut Arrived> {
        let arrived = self.0.entry(robot).or_default();
        if (arrived.tick, arrived.incarnation) < (tick, incarnation) {
            *arrived = Arrived {
                tick,
                incarnation,
                ..Arrived::default()
            };
        }
        ((arrived.tick, arrived.incarnation) == (tick, incarnation)).then_some(arrived)
    }
}

#[cfg(test)]
mod tests {
    use proto::allocation::{AllocationMessage, OpenMessage};
    use proto::team::BroadcastContent;
    use scenario::time::SimTime;

    use super::*;

    fn broadcast(tick: Tick, index: u16) -> Broadcast {
        Broadcast {
            sender: RobotId(1),
            incarnation: 1,
            tick,
            index,
            seq: 0,
            sent: SimTime(50 * tick),
            body: BroadcastContent::Allocation(AllocationMessage::Open(OpenMessage {
                schema: String::new(),
                bytes: Vec::new(),
            })),
        }
    }

    fn report(tick: Tick, broadcasts: u16) -> Report {
        Report {
            robot: RobotId(1),
            incarnation: 1,
            tick,
            broadcasts,
            ..Report::default()
        }
    }

    #[test]
    fn a_report_without_a_broadcast_is_repeated_once() {
        let mut overheard = Overheard::default();
        overheard.add(&broadcast(7, 0));
        assert_eq!(overheard.check(&report(7, 2)), Completeness::Repeat);
        // The repetition contains both.
        overheard.add(&broadcast(7, 0));
        overheard.add(&broadcast(7, 1));
        assert_eq!(overheard.check(&report(7, 2)), Completeness::Complete);

        overheard.add(&broadcast(8, 1));
        assert_eq!(overheard.check(&report(8, 2)), Completeness::Repeat);
        assert_eq!(overheard.check(&report(8, 2)), Completeness::Missing);
        assert_eq!(overheard.check(&report(9, 0)), Completeness::Complete);
        assert_eq!(overheard.check(&report(10, 1)), Completeness::Repeat);
    }

    #[test]
    fn an_old_broadcast_does_not_replace_those_of_the_current_tick() {
        let mut overheard = Overheard::default();
        overheard.add(&broadcast(7, 0));
        overheard.add(&broadcast(6, 0));
        assert_eq!(overheard.check(&report(7, 1)), Completeness::Complete);
    }
}
