//! Announces tasks, closes auctions, renews contracts.

use std::cmp::Reverse;

use alliance_proto::allocation::murdoch::{AuctionId, Negotiation, Word};
use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::time::SimTime;
use smallvec::SmallVec;

use super::ledger::Ledger;
use super::{Life, Monitor, Offers, Terms};
use crate::allocator::utility::Bid;
use crate::allocator::{Input, Me};
use crate::by_rank::ByRank;

/// One robot as auctioneer of the tasks that it can do itself.
#[derive(Clone, Debug)]
pub struct Auctioneer {
    me: RobotId,
    incarnation: Incarnation,
    terms: Terms,
    /// Number of the next auction.
    number: u32,
    /// By place of the task.
    desks: SmallVec<[Desk; 6]>,
    /// Who does not get which task until when.
    bans: Vec<(usize, RobotId, SimTime)>,
}

/// What the auctioneer has to do with a task.
#[derive(Clone, Debug)]
struct Desk {
    task: TaskId,
    priority: i32,
    /// Time without progress after which a contract is not renewed.
    patience: SimTime,
    /// Since when this robot has been its auctioneer.
    in_office: Option<SimTime>,
    /// When a lower-ranked one that can do it was last heard to care for it, or it was not due.
    attended: SimTime,
    open: Option<Open>,
}

/// An auction that takes bids.
#[derive(Clone, Debug)]
struct Open {
    auction: AuctionId,
    round: SimTime,
    closes: SimTime,
    bids: SmallVec<[(RobotId, f32); 4]>,
}

impl Auctioneer {
    pub fn new(me: &Me, tasks: &[TaskId], terms: Terms) -> Self {
        let desk = |task: &TaskId| {
            let brief = &me.briefs[task.index()];
            Desk {
                task: *task,
                priority: brief.priority,
                patience: SimTime::from_secs_f64(terms.progress_units * brief.unit_s),
                in_office: None,
                attended: SimTime::ZERO,
                open: None,
            }
        };
        Self {
            me: me.robot,
            incarnation: me.incarnation,
            terms,
            number: 0,
            desks: tasks.iter().map(desk).collect(),
            bans: Vec::new(),
        }
    }

    /// An auctioneer cares for a task.
    pub fn attended(&mut self, place: usize, by: RobotId, now: SimTime) {
        if by < self.me {
            self.desks[place].attended = now;
        }
    }

    /// A bid, as far as it is one: a number, for an auction that is open.
    pub fn bid(&mut self, place: usize, auction: AuctionId, robot: RobotId, utility: f32) {
        if let Some(open) = &mut self.desks[place].open
            && open.auction == auction
            && utility.is_finite()
            && !open.bids.iter().any(|(known, _)| *known == robot)
        {
            open.bids.push((robot, utility));
        }
    }

    /// Whether a robot is not to get a task.
    pub fn is_banned(&self, place: usize, robot: RobotId, now: SimTime) -> bool {
        let mut bans = self.bans.iter();
        bans.any(|&(what, who, until)| what == place && who == robot && now < until)
    }

    /// What the office asks for in a step.
    pub fn act(
        &mut self,
        offers: &Offers<'_>,
        input: &Input<'_>,
        me: &Me,
        alive: &ByRank<Life>,
        ledger: &mut Ledger,
        said: &mut Vec<Negotiation>,
    ) {
        let now = input.now;
        self.bans.retain(|(_, _, until)| now < *until);
        for place in 0..self.desks.len() {
            self.take_office(place, offers, me, alive, now);
            if let Some(offer) = &offers[place] {
                ledger.void(place, offer.choice.round);
            }
            if self.desks[place].in_office.is_some() {
                self.renew(place, ledger, said, now);
            }
        }
        self.close(ledger, said, now);
        self.open(offers, ledger, said, now);
    }

    /// Whether this robot is auctioneer of the task.
    fn take_office(
        &mut self,
        place: usize,
        offers: &Offers<'_>,
        me: &Me,
        alive: &ByRank<Life>,
        now: SimTime,
    ) {
        let Terms {
            lease,
            ceased_after,
            ..
        } = self.terms;
        let desk = &mut self.desks[place];
        if offers[place].is_none() {
            desk.attended = now;
        }
        let able = &me.briefs[desk.task.index()].robots;
        let mut lower = able.iter().take_while(|robot| **robot < self.me);
        let is_alive = |robot: &RobotId| {
            let known = alive.place(*robot).ok().map(|it| alive.at(it));
            known.is_some_and(|life| now.since(life.heard) < ceased_after)
        };
        let is_first = !lower.any(is_alive);
        let is_unattended = now.since(desk.attended) >= lease + ceased_after;
        if !is_first && !is_unattended {
            desk.in_office = None;
            desk.open = None;
        } else if desk.in_office.is_none() {
            desk.in_office = Some(now);
        }
    }

    /// Renews the contracts that hold, unless their winners get nowhere.
    fn renew(
        &mut self,
        place: usize,
        ledger: &mut Ledger,
        said: &mut Vec<Negotiation>,
        now: SimTime,
    ) {
        let desk = &self.desks[place];
        let mut useless = None;
        for contract in ledger.of_mut(place) {
            if self.terms.monitor == Monitor::Progress
                && now.since(contract.progressed) > desk.patience
            {
                useless = Some(contract.winner);
                continue;
            }
            let is_due = |renewed: SimTime| now.since(renewed) >= self.terms.renew_every;
            if contract.renewed.is_none_or(is_due) {
                contract.renewed = Some(now);
                said.push(Negotiation {
                    task: desk.task,
                    round: contract.round,
                    auction: contract.auction,
                    word: Word::Renew {
                        winner: contract.winner,
                    },
                });
            }
        }
        if let Some(winner) = useless {
            ledger.end(place, winner);
            self.bans.push((place, winner, now + self.terms.ban));
        }
    }

    /// Awards the auctions that close, the best bid first.
    fn close(&mut self, ledger: &mut Ledger, said: &mut Vec<Negotiation>, now: SimTime) {
        let closes = |desk: &Desk| desk.open.as_ref().is_some_and(|open| open.closes <= now);
        if !self.desks.iter().any(closes) {
            return;
        }
        while let Some((place, robot)) = self.best_bid(ledger, now) {
            let desk = &mut self.desks[place];
            let Some(open) = desk.open.take() else { break };
            ledger.award(place, open.auction, open.round, robot, now);
            if let Some(contract) = ledger
                .of_mut(place)
                .iter_mut()
                .find(|it| it.winner == robot)
            {
                contract.renewed = Some(now);
            }
            said.push(Negotiation {
                task: desk.task,
                round: open.round,
                auction: open.auction,
                word: Word::Renew { winner: robot },
            });
        }
        for desk in self.desks.iter_mut().filter(|desk| closes(desk)) {
            desk.open = None;
        }
    }

    /// The best bid of all auctions that close, of those who are free.
    fn best_bid(&self, ledger: &Ledger, now: SimTime) -> Option<(usize, RobotId)> {
        let mut best: Option<(usize, Bid)> = None;
        for (place, desk) in self.desks.iter().enumerate() {
            let Some(open) = desk.open.as_ref().filter(|open| open.closes <= now) else {
                continue;
            };
            if !ledger.has_room(place) {
                continue;
            }
            for &(robot, utility) in &open.bids {
                let bid = Bid {
                    priority: desk.priority,
                    utility: f64::from(utility),
                    robot,
                    task: desk.task,
                };
                let is_better = best.is_none_or(|(_, known)| bid.order(&known).is_gt());
                if is_better && !ledger.is_busy(robot) && !self.is_banned(place, robot, now) {
                    best = Some((place, bid));
                }
            }
        }
        best.map(|(place, bid)| (place, bid.robot))
    }

    /// Announces what is due and has room, the highest priority first.
    fn open(
        &mut self,
        offers: &Offers<'_>,
        ledger: &Ledger,
        said: &mut Vec<Negotiation>,
        now: SimTime,
    ) {
        let mut running = 0;
        for (place, desk) in self.desks.iter_mut().enumerate() {
            if offers[place].is_none() || !ledger.has_room(place) {
                desk.open = None;
            }
            running += usize::from(desk.open.is_some());
        }
        while running < self.terms.parallel {
            let may_open = |place: usize, desk: &Desk| {
                let has_listened = desk
                    .in_office
                    .is_some_and(|since| now.since(since) >= self.terms.lease);
                has_listened
                    && desk.open.is_none()
                    && offers[place].is_some()
                    && ledger.has_room(place)
            };
            let desks = self.desks.iter().enumerate();
            let next = desks
                .filter(|&(place, desk)| may_open(place, desk))
                .min_by_key(|(_, desk)| (Reverse(desk.priority), desk.task));
            let Some((place, offer)) = next.and_then(|(place, _)| Some((place, offers[place]?)))
            else {
                return;
            };
            let auction = AuctionId {
                auctioneer: self.me,
                incarnation: self.incarnation,
                number: self.number,
            };
            self.number = self.number.wrapping_add(1);
            let (round, closes) = (offer.choice.round, now + self.terms.auction);
            let desk = &mut self.desks[place];
            desk.open = Some(Open {
                auction,
                round,
                closes,
                bids: SmallVec::new(),
            });
            said.push(Negotiation {
                task: desk.task,
                round,
                auction,
                word: Word::Announce { closes },
            });
            running += 1;
        }
    }
}
