//! Bids for tasks, and does the one that it has a contract for.

use alliance_proto::allocation::murdoch::{AuctionId, Negotiation, Status, Word};
use alliance_proto::ids::{RobotId, TaskId};
use alliance_proto::telemetry::Reason;
use alliance_proto::time::SimTime;
use smallvec::SmallVec;

use super::ledger::Ledger;
use super::{Offer, Offers, Terms};
use crate::allocator::utility::COMMIT;
use crate::allocator::{Decision, Input, Me};

/// One robot as bidder and worker.
#[derive(Clone, Debug)]
pub struct Bidder {
    me: RobotId,
    terms: Terms,
    /// The own tasks.
    tasks: SmallVec<[TaskId; 6]>,
    /// The latest auction of each in which it bid.
    bids: SmallVec<[Option<AuctionId>; 6]>,
    contract: Option<Held>,
    /// The contract has ended, but the load is not yet brought away: which task, and since when.
    delivers: Option<(usize, SimTime)>,
    reason: Option<Reason>,
}

/// The contract of this robot.
#[derive(Clone, Copy, Debug)]
struct Held {
    place: usize,
    auction: AuctionId,
    round: SimTime,
    renewed: SimTime,
    /// When it last said so; `None`: not yet.
    acked: Option<SimTime>,
    progress: u32,
}

impl Bidder {
    pub fn new(me: &Me, tasks: &[TaskId], terms: Terms) -> Self {
        Self {
            me: me.robot,
            terms,
            tasks: tasks.into(),
            bids: tasks.iter().map(|_| None).collect(),
            contract: None,
            delivers: None,
            reason: None,
        }
    }

    /// An auction is open: a bid, once, from who is free and could do the task.
    pub fn invited(
        &mut self,
        place: usize,
        said: &Negotiation,
        closes: SimTime,
        offer: &Option<Offer<'_>>,
        now: SimTime,
        answers: &mut Vec<Negotiation>,
    ) {
        let is_free =
            self.contract.is_none() && self.delivers.is_none_or(|(task, _)| task == place);
        let utility = offer.and_then(|offer| offer.utility);
        if let Some(utility) = utility
            && is_free
            && now < closes
            && self.bids[place] != Some(said.auction)
        {
            self.bids[place] = Some(said.auction);
            answers.push(Negotiation {
                word: Word::Bid { utility },
                ..*said
            });
        }
    }

    /// The contract is awarded to this robot, or renewed.
    pub fn renewed(
        &mut self,
        place: usize,
        said: &Negotiation,
        offer: &Option<Offer<'_>>,
        now: SimTime,
        answers: &mut Vec<Negotiation>,
    ) {
        if let Some(held) = &mut self.contract
            && (held.place, held.auction) == (place, said.auction)
        {
            held.renewed = now;
            return;
        }
        // Of an earlier incarnation's bid it knows nothing.
        let has_bid = self.bids[place] == Some(said.auction);
        if self.contract.is_some() || offer.is_none() || !has_bid {
            answers.push(ack(said, Status::Abort, 0));
            return;
        }
        self.delivers = None;
        self.reason = Some(Reason::Awarded);
        self.contract = Some(Held {
            place,
            auction: said.auction,
            round: said.round,
            renewed: now,
            acked: None,
            progress: 0,
        });
    }

    /// What the contract asks for in a step.
    pub fn act(
        &mut self,
        offers: &Offers<'_>,
        input: &Input<'_>,
        ledger: &Ledger,
        decision: &mut Decision,
        said: &mut Vec<Negotiation>,
    ) {
        let now = input.now;
        if let Some(mut held) = self.contract.take() {
            let about = self.about(&held);
            let ended = if offers[held.place].is_none_or(|it| it.choice.round > held.round) {
                Some((Status::Done, None))
            } else if ledger.is_surplus(held.place, &held.auction, self.me) {
                Some((Status::Abort, Some(Reason::Outbid)))
            } else if now.since(held.renewed) > self.terms.lease {
                Some((Status::Abort, Some(Reason::LeaseEnded)))
            } else {
                None
            };
            if let Some((status, reason)) = ended {
                said.push(ack(&about, status, held.progress));
                self.reason = reason;
                self.bids[held.place] = None;
                let has_load = input.is_laden && status == Status::Abort;
                self.delivers = has_load.then_some((held.place, now));
            } else {
                let done = input.progressed.iter();
                let done = done.filter(|task| **task == about.task).count() as u32;
                held.progress += done;
                let is_due = |acked: SimTime| now.since(acked) >= self.terms.renew_every;
                if done > 0 || held.acked.is_none_or(is_due) {
                    held.acked = Some(now);
                    said.push(ack(&about, Status::Ongoing, held.progress));
                }
                self.contract = Some(held);
            }
        }
        self.delivers = self.delivers.filter(|&(place, since)| {
            input.is_laden && offers[place].is_some() && now.since(since) < COMMIT
        });

        let place = self.contract.map(|held| held.place);
        let place = place.or(self.delivers.map(|(place, _)| place));
        let active = place.and_then(|place| offers[place]);
        let active = active.map(|offer| offer.choice.behavior);
        if active != decision.active {
            decision.reason = self.reason.take();
        }
        decision.active = active;
    }

    fn about(&self, held: &Held) -> Negotiation {
        Negotiation {
            task: self.tasks[held.place],
            round: held.round,
            auction: held.auction,
            word: Word::Renew { winner: self.me },
        }
    }
}

/// The answer to a word about a contract.
fn ack(about: &Negotiation, status: Status, progress: u32) -> Negotiation {
    Negotiation {
        word: Word::Ack { status, progress },
        ..*about
    }
}
