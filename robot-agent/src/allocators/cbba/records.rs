//! The known bids for one place of one task in ACBBA: the newest report about each robot's bid, from any sender.
//!
//! The paper compares the times of two robots' claims (Johnson, Ponda, Choi, How, AIAA 2010). With incomplete links, a
//! withdrawn bid could then circulate without end. Here only reports about the same robot are compared by time, and
//! bids of different robots by value. Robots with the same reports agree for any order of arrival.

use proto::allocation::consensus::WinningBid;
use scenario::ids::RobotId;
use scenario::time::SimTime;

/// The newest report about one robot's bid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// The bidder and its bid; 0 after a withdrawal.
    pub claim: WinningBid,
    /// The time of the bid or withdrawal.
    pub made: SimTime,
    /// True if the record must be sent.
    pub is_unsaid: bool,
}

impl Record {
    fn is_newer_than(&self, other: &Self) -> bool {
        // A robot makes at most one bid per step. Only forged reports or a restarted robot can produce equal times.
        let key = |record: &Self| (record.made, record.claim.value);
        key(self) > key(other)
    }
}

/// The newest reports about all bidders for the place in this round, by rank.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records(Vec<Record>);

impl Records {
    fn find(&self, robot: RobotId) -> Result<usize, usize> {
        self.0
            .binary_search_by_key(&robot, |record| record.claim.robot)
    }

    pub fn record_of(&self, robot: RobotId) -> Option<&Record> {
        self.find(robot).ok().map(|at| &self.0[at])
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Record> {
        self.0.iter_mut()
    }

    /// Stores a report about a robot's bid and returns whether it was newer. A newer report, or the known record after
    /// an older one, is marked for sending.
    pub fn receive(&mut self, claim: WinningBid, made: SimTime) -> bool {
        let report = Record {
            claim,
            made,
            is_unsaid: true,
        };
        match self.find(claim.robot) {
            Err(at) => self.0.insert(at, report),
            Ok(at) => {
                let known = &mut self.0[at];
                if !report.is_newer_than(known) {
                    known.is_unsaid |= known.is_newer_than(&report);
                    return false;
                }
                *known = report;
            }
        }
        true
    }

    pub fn set(&mut self, claim: WinningBid, made: SimTime) {
        let record = Record {
            claim,
            made,
            is_unsaid: true,
        };
        match self.find(claim.robot) {
            Err(at) => self.0.insert(at, record),
            Ok(at) => self.0[at] = record,
        }
    }

    /// Marks the record of a robot for sending.
    pub fn tell(&mut self, robot: RobotId) {
        if let Ok(at) = self.find(robot) {
            self.0[at].is_unsaid = true;
        }
    }

    /// Returns the largest bid except that of `me`.
    pub fn best_except(&self, me: RobotId) -> Option<WinningBid> {
        let claims = self.0.iter().map(|record| record.claim);
        let others = claims.filter(|claim| claim.robot != me && claim.value > 0.0);
        others.reduce(|best, claim| if claim.beats(&best) { claim } else { best })
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }
}
