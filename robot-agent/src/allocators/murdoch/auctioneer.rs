//! The auctioneer: announces tasks, closes auctions, renews contracts.

use std::cmp::Reverse;

use proto::allocation::murdoch::{AuctionId, Negotiation, NegotiationKind};
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::ledger::Ledger;
use super::{Monitor, Offers, Settings, Teammate};
use crate::allocator::utility::Bid;
use crate::allocator::{Input, SelfState};
use crate::by_rank::ByRank;

#[derive(Clone, Debug)]
pub struct Auctioneer {
    me: RobotId,
    incarnation: Incarnation,
    settings: Settings,
    number: u32,
    entries: SmallVec<[Entry; 6]>,
    /// The excluded robots as (index of the task, robot, end of the exclusion).
    bans: Vec<(usize, RobotId, SimTime)>,
}

#[derive(Clone, Debug)]
struct Entry {
    task: TaskId,
    priority: i32,
    /// The time without progress after which a contract is not renewed.
    patience: SimTime,
    auctioneer_since: Option<SimTime>,
    /// The last time at which a lower-ranked auctioneer sent a message, or the task was not due.
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
    pub fn new(me: &SelfState, tasks: &[TaskId], settings: Settings) -> Self {
        let entry = |task: &TaskId| {
            let brief = &me.briefs[task.index()];
            Entry {
                task: *task,
                priority: brief.priority,
                patience: SimTime::from_secs_f64(settings.progress_units * brief.unit_s),
                auctioneer_since: None,
                attended: SimTime::ZERO,
                open: None,
            }
        };
        Self {
            me: me.robot,
            incarnation: me.incarnation,
            settings,
            number: 0,
            entries: tasks.iter().map(entry).collect(),
            bans: Vec::new(),
        }
    }

    /// Records a message of another auctioneer about a task.
    pub fn note_auctioneer(&mut self, place: usize, by: RobotId, now: SimTime) {
        if by < self.me {
            self.entries[place].attended = now;
        }
    }

    /// Stores a bid if it is finite and its auction is open.
    pub fn bid(&mut self, place: usize, auction: AuctionId, robot: RobotId, utility: f32) {
        if let Some(open) = &mut self.entries[place].open
            && open.auction == auction
            && utility.is_finite()
            && !open.bids.iter().any(|(known, _)| *known == robot)
        {
            open.bids.push((robot, utility));
        }
    }

    pub fn is_banned(&self, place: usize, robot: RobotId, now: SimTime) -> bool {
        let mut bans = self.bans.iter();
        bans.any(|&(banned_place, banned_robot, until)| {
            banned_place == place && banned_robot == robot && now < until
        })
    }

    pub fn step(
        &mut self,
        offers: &Offers<'_>,
        input: &Input<'_>,
        me: &SelfState,
        teammates: &ByRank<Teammate>,
        ledger: &mut Ledger,
        outgoing: &mut Vec<Negotiation>,
    ) {
        let now = input.now;
        self.bans.retain(|(_, _, until)| now < *until);
        for place in 0..self.entries.len() {
            self.update_role(place, offers, me, teammates, now);
            if let Some(offer) = &offers[place] {
                ledger.end_older_rounds(place, offer.choice.round);
            }
            if self.entries[place].auctioneer_since.is_some() {
                self.renew(place, ledger, outgoing, now);
            }
        }
        self.close(ledger, outgoing, now);
        self.open(offers, ledger, outgoing, now);
    }

    fn update_role(
        &mut self,
        place: usize,
        offers: &Offers<'_>,
        me: &SelfState,
        teammates: &ByRank<Teammate>,
        now: SimTime,
    ) {
        let Settings {
            lease,
            ceased_after,
            ..
        } = self.settings;
        let entry = &mut self.entries[place];
        if offers[place].is_none() {
            entry.attended = now;
        }
        let able = &me.briefs[entry.task.index()].robots;
        let mut lower = able.iter().take_while(|robot| **robot < self.me);
        let is_alive = |robot: &RobotId| {
            let known = teammates.place(*robot).ok().map(|at| teammates.at(at));
            known.is_some_and(|teammate| now.since(teammate.received) < ceased_after)
        };
        let is_first = !lower.any(is_alive);
        let is_unattended = now.since(entry.attended) >= lease + ceased_after;
        if !is_first && !is_unattended {
            entry.auctioneer_since = None;
            entry.open = None;
        } else if entry.auctioneer_since.is_none() {
            entry.auctioneer_since = Some(now);
        }
    }

    /// Renews the valid contracts, except those without progress if progress is monitored.
    fn renew(
        &mut self,
        place: usize,
        ledger: &mut Ledger,
        outgoing: &mut Vec<Negotiation>,
        now: SimTime,
    ) {
        let entry = &self.entries[place];
        let mut useless = None;
        for contract in ledger.valid_contracts_mut(place) {
            if self.settings.monitor == Monitor::Progress
                && now.since(contract.progressed) > entry.patience
            {
                useless = Some(contract.winner);
                continue;
            }
            let is_due = |renewed: SimTime| now.since(renewed) >= self.settings.renew_every;
            if contract.renewed.is_none_or(is_due) {
                contract.renewed = Some(now);
                outgoing.push(Negotiation {
                    task: entry.task,
                    round: contract.round,
                    auction: contract.auction,
                    word: NegotiationKind::Renew {
                        winner: contract.winner,
                    },
                });
            }
        }
        if let Some(winner) = useless {
            ledger.end(place, winner);
            self.bans.push((place, winner, now + self.settings.ban));
        }
    }

    /// Awards the auctions that close, the best bid first.
    fn close(&mut self, ledger: &mut Ledger, outgoing: &mut Vec<Negotiation>, now: SimTime) {
        let closes = |entry: &Entry| entry.open.as_ref().is_some_and(|open| open.closes <= now);
        if !self.entries.iter().any(closes) {
            return;
        }
        while let Some((place, robot)) = self.best_bid(ledger, now) {
            let entry = &mut self.entries[place];
            let Some(open) = entry.open.take() else { break };
            ledger.award(place, open.auction, open.round, robot, now);
            if let Some(contract) = ledger
                .valid_contracts_mut(place)
                .iter_mut()
                .find(|contract| contract.winner == robot)
            {
                contract.renewed = Some(now);
            }
            outgoing.push(Negotiation {
                task: entry.task,
                round: open.round,
                auction: open.auction,
                word: NegotiationKind::Renew { winner: robot },
            });
        }
        for entry in self.entries.iter_mut().filter(|entry| closes(entry)) {
            entry.open = None;
        }
    }

    /// Returns the best bid of a free robot in the auctions that close.
    fn best_bid(&self, ledger: &Ledger, now: SimTime) -> Option<(usize, RobotId)> {
        let mut best: Option<(usize, Bid)> = None;
        for (place, entry) in self.entries.iter().enumerate() {
            let Some(open) = entry.open.as_ref().filter(|open| open.closes <= now) else {
                continue;
            };
            if !ledger.has_room(place) {
                continue;
            }
            for &(robot, utility) in &open.bids {
                let bid = Bid {
                    priority: entry.priority,
                    utility: f64::from(utility),
                    robot,
                    task: entry.task,
                };
                let is_better = best.is_none_or(|(_, known)| bid.order(&known).is_gt());
                if is_better && !ledger.has_contract(robot) && !self.is_banned(place, robot, now) {
                    best = Some((place, bid));
                }
            }
        }
        best.map(|(place, bid)| (place, bid.robot))
    }

    /// Announces due tasks by priority.
    fn open(
        &mut self,
        offers: &Offers<'_>,
        ledger: &Ledger,
        outgoing: &mut Vec<Negotiation>,
        now: SimTime,
    ) {
        let mut running = 0;
        for (place, entry) in self.entries.iter_mut().enumerate() {
            if offers[place].is_none() || !ledger.has_room(place) {
                entry.open = None;
            }
            running += usize::from(entry.open.is_some());
        }
        while running < self.settings.parallel {
            let may_open = |place: usize, entry: &Entry| {
                let has_listened = entry
                    .auctioneer_since
                    .is_some_and(|since| now.since(since) >= self.settings.lease);
                has_listened
                    && entry.open.is_none()
                    && offers[place].is_some()
                    && ledger.has_room(place)
            };
            let entries = self.entries.iter().enumerate();
            let next = entries
                .filter(|&(place, entry)| may_open(place, entry))
                .min_by_key(|(_, entry)| (Reverse(entry.priority), entry.task));
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
            let (round, closes) = (offer.choice.round, now + self.settings.auction);
            let entry = &mut self.entries[place];
            entry.open = Some(Open {
                auction,
                round,
                closes,
                bids: SmallVec::new(),
            });
            outgoing.push(Negotiation {
                task: entry.task,
                round,
                auction,
                word: NegotiationKind::Announce { closes },
            });
            running += 1;
        }
    }
}
