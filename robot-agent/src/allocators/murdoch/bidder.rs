//! The bidder: bids for tasks, and executes the task of its contract.

use proto::allocation::murdoch::{AuctionId, ContractStatus, Negotiation, NegotiationKind};
use proto::telemetry::Reason;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::ledger::Ledger;
use super::{Offer, Offers, Settings};
use crate::allocator::utility::COMMIT;
use crate::allocator::{Decision, Input, SelfState};
use crate::broken::is_broken;

#[derive(Clone, Debug)]
pub struct Bidder {
    me: RobotId,
    settings: Settings,
    tasks: SmallVec<[TaskId; 6]>,
    /// The latest auction of each task in which the robot has bid.
    bids: SmallVec<[Option<AuctionId>; 6]>,
    contract: Option<Held>,
    /// The task and end time of a contract whose load is not delivered yet.
    delivery: Option<(usize, SimTime)>,
    reason: Option<Reason>,
}

#[derive(Clone, Copy, Debug)]
struct Held {
    place: usize,
    auction: AuctionId,
    round: SimTime,
    renewed: SimTime,
    /// The time of the last Ack; `None` before the first one.
    acked: Option<SimTime>,
    progress: u32,
}

impl Bidder {
    pub fn new(me: &SelfState, tasks: &[TaskId], settings: Settings) -> Self {
        Self {
            me: me.robot,
            settings,
            tasks: tasks.into(),
            bids: tasks.iter().map(|_| None).collect(),
            contract: None,
            delivery: None,
            reason: None,
        }
    }

    /// Bids once in an open auction if the robot is free and can do the task.
    pub fn receive_announcement(
        &mut self,
        place: usize,
        message: &Negotiation,
        closes: SimTime,
        offer: &Option<Offer<'_>>,
        now: SimTime,
        answers: &mut Vec<Negotiation>,
    ) {
        let is_free =
            self.contract.is_none() && self.delivery.is_none_or(|(task, _)| task == place);
        let utility = offer.and_then(|offer| offer.utility);
        if let Some(utility) = utility
            && is_free
            && now < closes
            && self.bids[place] != Some(message.auction)
        {
            self.bids[place] = Some(message.auction);
            answers.push(Negotiation {
                word: NegotiationKind::Bid { utility },
                ..*message
            });
        }
    }

    /// Applies an award or a renewal of this robot's contract.
    pub fn receive_renewal(
        &mut self,
        place: usize,
        message: &Negotiation,
        offer: &Option<Offer<'_>>,
        now: SimTime,
        answers: &mut Vec<Negotiation>,
    ) {
        if let Some(held) = &mut self.contract
            && (held.place, held.auction) == (place, message.auction)
        {
            held.renewed = now;
            return;
        }
        // Bids of an earlier incarnation are not stored.
        let has_bid = self.bids[place] == Some(message.auction);
        if self.contract.is_some() || offer.is_none() || !has_bid {
            answers.push(ack(message, ContractStatus::Abort, 0));
            return;
        }
        self.delivery = None;
        self.reason = Some(Reason::Awarded);
        self.contract = Some(Held {
            place,
            auction: message.auction,
            round: message.round,
            renewed: now,
            acked: None,
            progress: 0,
        });
    }

    pub fn act(
        &mut self,
        offers: &Offers<'_>,
        input: &Input<'_>,
        ledger: &Ledger,
        decision: &mut Decision,
        outgoing: &mut Vec<Negotiation>,
    ) {
        let now = input.now;
        if let Some(mut held) = self.contract.take() {
            let renewal = self.renewal_of(&held);
            let ended = if offers[held.place].is_none_or(|offer| offer.choice.round > held.round) {
                Some((ContractStatus::Done, None))
            } else if ledger.is_surplus(held.place, &held.auction, self.me) {
                Some((ContractStatus::Abort, Some(Reason::Outbid)))
            } else if now.since(held.renewed) > self.settings.lease
                && !is_broken("murdoch-leases-never-end")
            {
                Some((ContractStatus::Abort, Some(Reason::LeaseEnded)))
            } else {
                None
            };
            if let Some((status, reason)) = ended {
                outgoing.push(ack(&renewal, status, held.progress));
                self.reason = reason;
                self.bids[held.place] = None;
                let has_load = input.is_laden && status == ContractStatus::Abort;
                self.delivery = has_load.then_some((held.place, now));
            } else {
                let done = input.progressed.iter();
                let done = done.filter(|task| **task == renewal.task).count() as u32;
                held.progress += done;
                let is_due = |acked: SimTime| now.since(acked) >= self.settings.renew_every;
                if done > 0 || held.acked.is_none_or(is_due) {
                    held.acked = Some(now);
                    outgoing.push(ack(&renewal, ContractStatus::Ongoing, held.progress));
                }
                self.contract = Some(held);
            }
        }
        self.delivery = self.delivery.filter(|&(place, since)| {
            input.is_laden && offers[place].is_some() && now.since(since) < COMMIT
        });

        let place = self.contract.map(|held| held.place);
        let place = place.or(self.delivery.map(|(place, _)| place));
        let active = place.and_then(|place| offers[place]);
        let active = active.map(|offer| offer.choice.behavior);
        if active != decision.active {
            decision.reason = self.reason.take();
        }
        decision.active = active;
    }

    fn renewal_of(&self, held: &Held) -> Negotiation {
        Negotiation {
            task: self.tasks[held.place],
            round: held.round,
            auction: held.auction,
            word: NegotiationKind::Renew { winner: self.me },
        }
    }
}

fn ack(message: &Negotiation, status: ContractStatus, progress: u32) -> Negotiation {
    Negotiation {
        word: NegotiationKind::Ack { status, progress },
        ..*message
    }
}
