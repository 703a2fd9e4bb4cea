//! The contracts that a robot knows of, by task.

use std::cmp::Ordering;

use alliance_proto::allocation::murdoch::{AuctionId, Negotiation};
use alliance_proto::ids::{RobotId, TaskId};
use alliance_proto::time::SimTime;
use smallvec::SmallVec;

use super::Terms;
use crate::allocator::Me;

/// A robot's contract for a task.
#[derive(Clone, Copy, Debug)]
pub struct Contract {
    pub auction: AuctionId,
    pub round: SimTime,
    pub winner: RobotId,
    /// When it was awarded, or its winner last heard to be at it.
    pub answered: SimTime,
    /// When this robot renewed it last; `None` where others have.
    pub renewed: Option<SimTime>,
    progress: u32,
    /// When its winner's count last rose, or it began.
    pub progressed: SimTime,
}

/// All of them.
#[derive(Clone, Debug)]
pub struct Ledger {
    lease: SimTime,
    /// By place of the task; in each the one that holds first.
    contracts: SmallVec<[SmallVec<[Contract; 1]>; 6]>,
    max_robots: SmallVec<[usize; 6]>,
}

/// Which of two contracts holds, the first if [`Ordering::Less`]: the lower-ranked auctioneer's, then the later one.
pub fn precedence(one: &AuctionId, other: &AuctionId) -> Ordering {
    let later = (other.incarnation, other.number).cmp(&(one.incarnation, one.number));
    one.auctioneer.cmp(&other.auctioneer).then(later)
}

impl Ledger {
    pub fn new(me: &Me, tasks: &[TaskId], terms: Terms) -> Self {
        let max_robots = tasks.iter().map(|task| me.briefs[task.index()].max_robots);
        Self {
            lease: terms.lease,
            contracts: tasks.iter().map(|_| SmallVec::new()).collect(),
            max_robots: max_robots.collect(),
        }
    }

    /// The contracts for a task that hold.
    pub fn of_mut(&mut self, place: usize) -> &mut [Contract] {
        let all = &mut self.contracts[place];
        let most = all.len().min(self.max_robots[place]);
        &mut all[..most]
    }

    /// Whether a further robot may have the task.
    pub fn has_room(&self, place: usize) -> bool {
        self.contracts[place].len() < self.max_robots[place]
    }

    /// The best robot that has a task.
    pub fn holder_of(&self, place: usize) -> Option<RobotId> {
        self.contracts[place].first().map(|it| it.winner)
    }

    /// Whether that robot has any of the tasks.
    pub fn is_busy(&self, robot: RobotId) -> bool {
        let mut all = self.contracts.iter().flatten();
        all.any(|it| it.winner == robot)
    }

    /// Whether so many contracts of others hold before this one that no place is left.
    pub fn is_surplus(&self, place: usize, auction: &AuctionId, winner: RobotId) -> bool {
        let before = self.contracts[place]
            .iter()
            .filter(|it| it.winner != winner && precedence(&it.auction, auction).is_lt());
        before.count() >= self.max_robots[place]
    }

    /// A contract begins.
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

    /// An auctioneer says that a robot has the task. Only its own words prolong that.
    pub fn note_award(&mut self, place: usize, said: &Negotiation, winner: RobotId, now: SimTime) {
        let known = self.contracts[place].iter().find(|it| it.winner == winner);
        if known.is_none_or(|known| precedence(&said.auction, &known.auction).is_lt()) {
            self.award(place, said.auction, said.round, winner, now);
        }
    }

    /// A robot says what it has achieved so far; `None`: that its contract has ended.
    pub fn note_ack(
        &mut self,
        place: usize,
        said: &Negotiation,
        sender: RobotId,
        progress: Option<u32>,
        now: SimTime,
    ) {
        let Some(progress) = progress else {
            self.contracts[place].retain(|it| it.winner != sender || it.auction != said.auction);
            return;
        };
        self.note_award(place, said, sender, now);
        let mut contracts = self.contracts[place].iter_mut();
        if let Some(known) = contracts.find(|it| it.winner == sender && it.auction == said.auction)
        {
            known.answered = now;
            if progress > known.progress {
                known.progress = progress;
                known.progressed = now;
            }
        }
    }

    /// Ends a robot's contract for a task.
    pub fn end(&mut self, place: usize, winner: RobotId) {
        self.contracts[place].retain(|it| it.winner != winner);
    }

    /// Ends all contracts of a robot.
    pub fn end_all(&mut self, winner: RobotId) {
        for place in 0..self.contracts.len() {
            self.end(place, winner);
        }
    }

    /// Ends what has not been answered for the time of a lease.
    pub fn forget(&mut self, now: SimTime) {
        for contracts in &mut self.contracts {
            contracts.retain(|it| now.since(it.answered) <= self.lease);
        }
    }

    /// Ends what is about an older round of a task.
    pub fn void(&mut self, place: usize, older_than: SimTime) {
        self.contracts[place].retain(|it| it.round >= older_than);
    }

    fn insert(&mut self, place: usize, contract: Contract) {
        let all = &mut self.contracts[place];
        all.retain(|it| it.winner != contract.winner);
        let at = all.partition_point(|it| precedence(&it.auction, &contract.auction).is_lt());
        all.insert(at, contract);
    }
}
