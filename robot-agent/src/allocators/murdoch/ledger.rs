//! The known contracts of a robot, by task.

use std::cmp::Ordering;

use proto::allocation::murdoch::{AuctionId, Negotiation};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::Settings;
use crate::allocator::SelfState;
use crate::broken::is_broken;

#[derive(Clone, Copy, Debug)]
pub struct Contract {
    pub auction: AuctionId,
    pub round: SimTime,
    pub winner: RobotId,
    /// The time of the award or of the winner's last Ack.
    pub answered: SimTime,
    /// The time of this robot's last renewal; `None` if other auctioneers renew it.
    pub renewed: Option<SimTime>,
    progress: u32,
    /// The time at which the winner's progress count last rose, or of the award.
    pub progressed: SimTime,
}

#[derive(Clone, Debug)]
pub struct Ledger {
    lease: SimTime,
    /// The contracts by index of the task, the first in precedence first.
    contracts: SmallVec<[SmallVec<[Contract; 1]>; 6]>,
    max_robots: SmallVec<[usize; 6]>,
}

/// Orders two contracts; the first is valid if [`Ordering::Less`]: the lower-ranked auctioneer's, then the later one.
pub fn precedence(one: &AuctionId, other: &AuctionId) -> Ordering {
    let later = (other.incarnation, other.number).cmp(&(one.incarnation, one.number));
    one.auctioneer.cmp(&other.auctioneer).then(later)
}

impl Ledger {
    pub fn new(me: &SelfState, tasks: &[TaskId], settings: Settings) -> Self {
        let max_robots = tasks.iter().map(|task| me.briefs[task.index()].max_robots);
        Self {
            lease: settings.lease,
            contracts: tasks.iter().map(|_| SmallVec::new()).collect(),
            max_robots: max_robots.collect(),
        }
    }

    /// Returns the valid contracts for a task.
    pub fn valid_contracts_mut(&mut self, place: usize) -> &mut [Contract] {
        let all = &mut self.contracts[place];
        let most = all.len().min(self.max_robots[place]);
        &mut all[..most]
    }

    pub fn has_room(&self, place: usize) -> bool {
        self.contracts[place].len() < self.max_robots[place]
            || is_broken("murdoch-contracts-count-as-free")
    }

    /// Returns the robot whose contract for a task comes first.
    pub fn holder_of(&self, place: usize) -> Option<RobotId> {
        self.contracts[place]
            .first()
            .map(|contract| contract.winner)
    }

    pub fn has_contract(&self, robot: RobotId) -> bool {
        let mut all = self.contracts.iter().flatten();
        all.any(|contract| contract.winner == robot)
    }

    /// Returns whether better contracts of other robots take all places of the task.
    pub fn is_surplus(&self, place: usize, auction: &AuctionId, winner: RobotId) -> bool {
        let before = self.contracts[place].iter().filter(|contract| {
            contract.winner != winner && precedence(&contract.auction, auction).is_lt()
        });
        before.count() >= self.max_robots[place]
    }

    pub fn award(
        &mut self,
        place: usize,
        auction: AuctionId,
        round: SimTime,
        winner: RobotId,
        now: SimTime,
    ) {
        self.insert(
            place,
            Contract {
                auction,
                round,
                winner,
                answered: now,
                renewed: None,
                progress: 0,
                progressed: now,
            },
        );
    }

    /// Records a contract that an auctioneer reports. Only the winner's own messages prolong it.
    pub fn note_award(
        &mut self,
        place: usize,
        message: &Negotiation,
        winner: RobotId,
        now: SimTime,
    ) {
        let known = self.contracts[place]
            .iter()
            .find(|contract| contract.winner == winner);
        if known.is_none_or(|known| precedence(&message.auction, &known.auction).is_lt()) {
            self.award(place, message.auction, message.round, winner, now);
        }
    }

    /// Records a winner's progress count; `None` ends its contract.
    pub fn note_ack(
        &mut self,
        place: usize,
        message: &Negotiation,
        sender: RobotId,
        progress: Option<u32>,
        now: SimTime,
    ) {
        let Some(progress) = progress else {
            self.contracts[place].retain(|contract| {
                contract.winner != sender || contract.auction != message.auction
            });
            return;
        };
        self.note_award(place, message, sender, now);
        let mut contracts = self.contracts[place].iter_mut();
        if let Some(known) = contracts
            .find(|contract| contract.winner == sender && contract.auction == message.auction)
        {
            known.answered = now;
            if progress > known.progress {
                known.progress = progress;
                known.progressed = now;
            }
        }
    }

    pub fn end(&mut self, place: usize, winner: RobotId) {
        self.contracts[place].retain(|contract| contract.winner != winner);
    }

    pub fn end_all(&mut self, winner: RobotId) {
        for place in 0..self.contracts.len() {
            self.end(place, winner);
        }
    }

    pub fn end_expired(&mut self, now: SimTime) {
        for contracts in &mut self.contracts {
            contracts.retain(|contract| now.since(contract.answered) <= self.lease);
        }
    }

    pub fn end_older_rounds(&mut self, place: usize, older_than: SimTime) {
        self.contracts[place].retain(|contract| contract.round >= older_than);
    }

    fn insert(&mut self, place: usize, contract: Contract) {
        let all = &mut self.contracts[place];
        all.retain(|known| known.winner != contract.winner);
        let at = all.partition_point(|known| precedence(&known.auction, &contract.auction).is_lt());
        all.insert(at, contract);
    }
}
