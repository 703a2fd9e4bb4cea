//! The current auction: the bids that a robot has received, and the auction's end.

use proto::allocation::ssi::{AuctionBid, CostBid};
use scenario::ids::{Incarnation, RobotId};
use scenario::time::SimTime;

use crate::allocator::TaskBrief;
use crate::broken::is_broken;
use crate::by_rank::ByRank;

/// The latest message of a teammate about an auction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Teammate {
    /// The incarnation and sequence number of the message.
    number: (Incarnation, u64),
    /// The send time of the latest broadcast of any kind.
    seen: SimTime,
    auction: u32,
    sent: SimTime,
    bid: Option<CostBid>,
}

/// A change by a received message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// An older message, or a second copy.
    Old,
    Newer,
    /// The first message of a robot or of its new incarnation.
    Newcomer,
}

#[derive(Clone, Debug, Default)]
pub struct Auction {
    /// The number of the auction. Each auction awards one task.
    pub number: u32,
    /// The robot's own bid, once it has one.
    pub bid: Option<CostBid>,
    teammates: ByRank<Teammate>,
    /// The time at which the auction began for this robot.
    begun: SimTime,
    /// The time of the robot's latest message about this auction.
    sent: Option<SimTime>,
    /// The time at which the robot had the first bid of this auction.
    since: Option<SimTime>,
}

impl Auction {
    /// Records a sign of life of a robot that takes part in auctions.
    pub fn note_seen(&mut self, robot: RobotId, sent: SimTime) {
        if let Ok(at) = self.teammates.place(robot) {
            let seen = &mut self.teammates.at_mut(at).seen;
            *seen = sent.max(*seen);
        }
    }

    pub fn receive(
        &mut self,
        sender: RobotId,
        number: (Incarnation, u64),
        sent: SimTime,
        message: &AuctionBid,
    ) -> Arrival {
        let known = self.teammates.place(sender).ok();
        let before = known.map(|at| self.teammates.at(at).number);
        if before.is_some_and(|before| before >= number) {
            return Arrival::Old;
        }
        let teammate = self.teammates.get_or_insert_with(sender, Teammate::default);
        *teammate = Teammate {
            number,
            seen: sent.max(teammate.seen),
            auction: message.auction,
            sent,
            bid: message.bid,
        };
        match before {
            Some((incarnation, _)) if incarnation == number.0 => Arrival::Newer,
            _ => Arrival::Newcomer,
        }
    }

    /// Removes a robot that has been silent for `tau`, and returns it.
    pub fn remove_silent(&mut self, now: SimTime, tau: SimTime) -> Option<RobotId> {
        let mut known = self.teammates.iter();
        let at = known.position(|(_, teammate)| now.since(teammate.seen) >= tau)?;
        drop(known);
        Some(self.teammates.remove(at))
    }

    /// Returns the number of robots that take part, without this one.
    pub fn bidders(&self) -> usize {
        self.teammates.places().len()
    }

    /// Returns the latest auction of which any teammate has sent a message.
    pub fn latest(&self) -> u32 {
        let numbers = self.teammates.iter().map(|(_, teammate)| teammate.auction);
        numbers.max().unwrap_or(0)
    }

    /// Begins an auction without bids of this robot.
    pub fn begin(&mut self, number: u32, now: SimTime) {
        (self.number, self.begun) = (number, now);
        (self.bid, self.sent, self.since) = (None, None, None);
    }

    /// Returns the bids for this auction with their bidders and send times.
    fn bids<'a>(
        &'a self,
        me: RobotId,
    ) -> impl Iterator<Item = (RobotId, CostBid, SimTime)> + use<'a> {
        let own = self.bid.map(|bid| (me, bid, self.sent));
        let own = own.and_then(|(me, bid, sent)| Some((me, bid, sent?)));
        let current = self.teammates.iter();
        let current = current.filter(|(_, teammate)| teammate.auction == self.number);
        let others =
            current.filter_map(|(robot, teammate)| Some((robot, teammate.bid?, teammate.sent)));
        others.chain(own)
    }

    /// Returns whether a message without a bid answers a bid: it was sent later, or in the step in which the auction
    /// began with that bid. In any other step its sender may not have known the task yet.
    fn is_answer(&self, sent: SimTime, bid: SimTime) -> bool {
        sent > bid || (sent == bid && bid == self.begun)
    }

    /// Returns whether all robots have answered, or the first bid is older than `window`. If `waits_for_unknown`,
    /// robots without any message count as bidders.
    pub fn is_over(
        &mut self,
        me: RobotId,
        now: SimTime,
        window: SimTime,
        waits_for_unknown: bool,
    ) -> bool {
        let Some(opened) = self.bids(me).map(|(_, _, sent)| sent).min() else {
            return false;
        };
        let since = *self.since.get_or_insert(now);
        let has_answered = |teammate: &Teammate| {
            teammate.auction == self.number
                && (teammate.bid.is_some() || self.is_answer(teammate.sent, opened))
        };
        let is_complete = !waits_for_unknown
            && self
                .sent
                .is_some_and(|sent| self.bid.is_some() || self.is_answer(sent, opened))
            && self
                .teammates
                .iter()
                .all(|(_, teammate)| has_answered(teammate));
        let is_late = now.since(since) >= window && !is_broken("ssi-waits-for-all-bids");
        is_complete || is_late
    }

    /// Returns whether a teammate's bid still needs an answer of this robot.
    pub fn needs_answer(&self) -> bool {
        let current = self.teammates.iter();
        let current = current.filter(|(_, teammate)| teammate.auction == self.number);
        let mut bids = current.filter(|(_, teammate)| teammate.bid.is_some());
        let is_answered = |bid| self.sent.is_some_and(|sent| self.is_answer(sent, bid));
        self.bid.is_none() && bids.any(|(_, other)| !is_answered(other.sent))
    }

    /// Returns whether the robot has sent its latest bid.
    pub fn is_sent(&self) -> bool {
        self.sent.is_some()
    }

    /// Replaces the bid of this robot, which must be sent.
    pub fn set_bid(&mut self, bid: Option<CostBid>) {
        (self.bid, self.sent) = (bid, None);
    }

    pub fn note_sent(&mut self, now: SimTime) {
        self.sent = Some(now);
    }

    /// Returns the best bid for which `is_free` is true: the highest priority, then the lowest cost, the lowest task
    /// and the lowest rank.
    pub fn winner(
        &self,
        me: RobotId,
        briefs: &[TaskBrief],
        is_free: impl Fn(&CostBid) -> bool,
    ) -> Option<(RobotId, CostBid)> {
        let sound = self.bids(me).filter(|(_, bid, _)| {
            bid.task.index() < briefs.len() && bid.cost.is_finite() && bid.cost >= 0.0
        });
        let free = sound.filter(|(_, bid, _)| is_free(bid));
        let best = free.min_by(|(a_robot, a, _), (b_robot, b, _)| {
            let priority = |bid: &CostBid| briefs[bid.task.index()].priority;
            let order = priority(b).cmp(&priority(a));
            let order = order.then(a.cost.total_cmp(&b.cost));
            let order = order.then((a.task, a.slot).cmp(&(b.task, b.slot)));
            order.then(a_robot.cmp(b_robot))
        });
        best.map(|(robot, bid, _)| (robot, bid))
    }
}
