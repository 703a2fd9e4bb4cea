//! MURDOCH: auctions of tasks (Gerkey and Matarić, AAAI 2000, T-RA 2002; docs/allocators/murdoch.md). Free robots bid
//! their utility for an announced task. The best bid wins a contract for a limited time, which the auctioneer renews
//! while the winner answers. A later, better bidder does not take it over.
//!
//! - `ledger`: the known contracts. Every robot maintains it, so that a new auctioneer has it.
//! - `auctioneer`: announces, closes and renews. `bidder`: bids, works and answers.
//! - `mod.rs`: a step and its messages. A robot receives its own messages one step later, as its teammates do.
//!
//! # Decisions beyond the paper
//! - The auctioneer of a task is the lowest-ranked robot received within τ that has a behavior for it. The next robot
//!   replaces auctioneers that broadcast nothing about a due task for τ + `lease_s`, because their knowledge may be
//!   outdated or their messages lost.
//! - The winner sends an Ack every 1/`renew_hz`, not in answer to each Renew. A new auctioneer thus receives the
//!   contracts of a crashed one.
//! - A contract ends `lease_s` after its latest Renew for the winner, and `lease_s` after its latest Ack for all
//!   others. Messages cannot change this time.
//! - Of two contracts for one place the lower-ranked auctioneer's is valid; of the same auctioneer's, the later one.
//! - Auctions that close in the same step are awarded in the order of the best bid, so that no robot wins twice.
//! - A robot that carries something when its contract ends delivers it first, for at most
//!   [`COMMIT`](crate::allocator::utility::COMMIT).
//! - `progress_units` are units of the task as estimated by `alliance check`.

mod auctioneer;
mod bidder;
mod ledger;
#[cfg(test)]
mod tests;

use proto::allocation::AllocationMessage;
use proto::allocation::murdoch::{ContractStatus, Negotiation, NegotiationKind};
use proto::team::BroadcastContent;
use scenario::ParameterRange::{self, Above, Whole, Within};
use scenario::ParameterSpec;
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;
use serde::Deserialize;
use smallvec::SmallVec;

use crate::allocator::utility::WorkInProgress;
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState, parameters};
use crate::broken::is_broken;
use crate::by_rank::ByRank;
use auctioneer::Auctioneer;
use bidder::Bidder;
use ledger::Ledger;

#[derive(Clone, Debug)]
pub struct Murdoch {
    me: SelfState,
    under_way: WorkInProgress,
    tasks: SmallVec<[TaskId; 6]>,
    teammates: ByRank<Teammate>,
    /// The number of each teammate's latest message, by index of the task.
    latest: SmallVec<[ByRank<(Incarnation, u64)>; 6]>,
    ledger: Ledger,
    auctioneer: Auctioneer,
    bidder: Bidder,
    /// The robot's own messages of the previous step; `spare` is a reused buffer.
    own_messages: Vec<Negotiation>,
    spare: Vec<Negotiation>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Teammate {
    incarnation: Incarnation,
    received: SimTime,
}

parameters! {
    /// The parameters in `[allocators.murdoch]`.
    pub struct Config {
        auction_s: f64 = 0.5, "s", Above(0.0, 1e6),
            "time for which an auction takes bids; at least three steps (the TAlMech implementation: 0.5 and 1.5 s)";
        renew_hz: f64 = 1.0, "Hz", Above(0.0, 1000.0),
            "rate at which contracts are renewed and answered (TAlMech: 1.5 and 2 Hz)";
        lease_s: f64 = 6.0, "s", Above(0.0, 1e6),
            "duration of a contract without renewal (the paper's times are not known)";
        parallel: usize = 8, "", Whole(1, 10_000),
            "maximum number of open auctions of one auctioneer (TAlMech: 1 and 8)";
        monitor: Monitor = Monitor::Ack => "ack", "", ParameterRange::Choice(&["ack", "progress"]),
            "condition for renewal: the winner answers (ack), or also makes progress (progress) (decided here)";
        progress_units: f64 = 2.0, "", Above(0.0, 1e6),
            "with monitor = progress: time without progress after which a contract ends, in units of the task's work (decided here)";
        ban_s: f64 = 120.0, "s", Within(0.0, 1e9),
            "time for which a robot that lost a contract without progress is excluded from the task (decided here)";
    }
}

/// The condition for the renewal of a contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Monitor {
    /// Renewal requires answers of the winner.
    Ack,
    /// Renewal requires answers and progress of the winner.
    Progress,
}

#[derive(Clone, Copy, Debug)]
struct Settings {
    /// The auction time; at least three steps.
    auction: SimTime,
    renew_every: SimTime,
    lease: SimTime,
    parallel: usize,
    monitor: Monitor,
    progress_units: f64,
    ban: SimTime,
    ceased_after: SimTime,
}

impl Settings {
    fn of(config: &Config, me: &SelfState) -> Self {
        let span = SimTime::from_secs_f64;
        // The announcement, its receipt with the bid, and the receipt of the bid take three steps.
        let least = span(3.0 * me.step_s);
        Self {
            auction: span(config.auction_s).max(least),
            renew_every: span(1.0 / config.renew_hz),
            lease: span(config.lease_s),
            parallel: config.parallel,
            monitor: config.monitor,
            progress_units: config.progress_units,
            ban: span(config.ban_s),
            ceased_after: me.ceased_after,
        }
    }
}

impl Allocator for Murdoch {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        Config::parameters()
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        let tasks: SmallVec<[TaskId; 6]> = me.own_tasks().into();
        let settings = Settings::of(config, me);
        Self {
            under_way: WorkInProgress::default(),
            teammates: ByRank::default(),
            latest: tasks.iter().map(|_| ByRank::default()).collect(),
            ledger: Ledger::new(me, &tasks, settings),
            auctioneer: Auctioneer::new(me, &tasks, settings),
            bidder: Bidder::new(me, &tasks, settings),
            own_messages: Vec::new(),
            spare: Vec::new(),
            tasks,
            me: me.clone(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.record_progress(&self.me, input);
        let mut outgoing = std::mem::take(&mut self.spare);
        let offers = self.offers(input);

        for broadcast in input.received {
            let sender = broadcast.sender;
            if !self.me.is_teammate(sender) {
                continue;
            }
            let teammate = self.teammates.get_or_insert_with(sender, Teammate::default);
            teammate.received = input.now;
            if broadcast.incarnation > teammate.incarnation {
                teammate.incarnation = broadcast.incarnation;
                // The new incarnation has no contracts.
                self.ledger.end_all(sender);
            }
            if let BroadcastContent::Allocation(AllocationMessage::Murdoch(negotiation)) =
                &broadcast.body
            {
                let number = (broadcast.incarnation, broadcast.seq);
                self.receive(
                    sender,
                    Some(number),
                    negotiation,
                    &offers,
                    input,
                    &mut outgoing,
                );
            }
        }
        let own_messages = std::mem::take(&mut self.own_messages);
        for negotiation in &own_messages {
            self.receive(
                self.me.robot,
                None,
                negotiation,
                &offers,
                input,
                &mut outgoing,
            );
        }

        if !is_broken("murdoch-leases-never-end") {
            self.ledger.end_expired(input.now);
        }
        self.bidder
            .act(&offers, input, &self.ledger, decision, &mut outgoing);
        self.auctioneer.step(
            &offers,
            input,
            &self.me,
            &self.teammates,
            &mut self.ledger,
            &mut outgoing,
        );

        // Messages about running contracts are more urgent than those about new ones.
        outgoing.sort_by_key(|message: &Negotiation| match message.word {
            NegotiationKind::Ack { .. } => 0,
            NegotiationKind::Renew { .. } => 1,
            NegotiationKind::Announce { .. } => 2,
            NegotiationKind::Bid { .. } => 3,
        });
        outgoing.truncate(1 + self.tasks.len());
        let messages = outgoing.iter().copied().map(AllocationMessage::Murdoch);
        decision.say.extend(messages);
        self.own_messages = outgoing;
        self.spare = own_messages;
        self.spare.clear();

        let holder = |task| self.ledger.holder_of(self.place_of(task)?);
        self.under_way.log(&self.me, input, decision, holder);
        self.under_way.record_active(decision.active, input.now);
    }
}

type Offers<'a> = SmallVec<[Option<Offer<'a>>; 6]>;

/// The robot's best behavior for a task.
#[derive(Clone, Copy, Debug)]
struct Offer<'a> {
    choice: &'a Choice,
    /// The utility in the precision of the message; `None` if the cost is not known.
    utility: Option<f32>,
}

impl Murdoch {
    fn place_of(&self, task: TaskId) -> Option<usize> {
        self.tasks.binary_search(&task).ok()
    }

    fn offers<'a>(&self, input: &Input<'a>) -> Offers<'a> {
        let mut offers: Offers<'a> = self.tasks.iter().map(|_| None).collect();
        for choice in input.choices.iter().filter(|choice| choice.applicable) {
            let Some(place) = self.place_of(choice.task) else {
                continue;
            };
            let utility = self
                .under_way
                .utility(choice, input)
                .map(|utility| utility as f32);
            if offers[place].is_none_or(|known: Offer<'_>| utility > known.utility) {
                offers[place] = Some(Offer { choice, utility });
            }
        }
        offers
    }

    /// Applies a received message. `number` detects repeated messages; the robot's own messages have none.
    fn receive(
        &mut self,
        sender: RobotId,
        number: Option<(Incarnation, u64)>,
        message: &Negotiation,
        offers: &Offers<'_>,
        input: &Input<'_>,
        answers: &mut Vec<Negotiation>,
    ) {
        let Some(place) = self.place_of(message.task) else {
            return;
        };
        let is_void = offers[place].is_some_and(|offer| message.round < offer.choice.round);
        if message.round > input.now
            || is_void
            || message.auction.auctioneer.index() >= self.me.team
        {
            return;
        }
        if let Some(number) = number {
            let latest = self.latest[place].get_or_insert_with(sender, Default::default);
            if number <= *latest {
                return;
            }
            *latest = number;
        }
        match message.word {
            NegotiationKind::Announce { closes } => {
                self.auctioneer.note_auctioneer(place, sender, input.now);
                self.bidder.receive_announcement(
                    place,
                    message,
                    closes,
                    &offers[place],
                    input.now,
                    answers,
                );
            }
            NegotiationKind::Bid { utility } => {
                self.auctioneer.bid(place, message.auction, sender, utility);
            }
            NegotiationKind::Renew { winner } => {
                if winner.index() >= self.me.team {
                    return;
                }
                self.auctioneer.note_auctioneer(place, sender, input.now);
                // The ledger already contains the robot's own awards, unless they were returned since.
                if sender != self.me.robot {
                    self.ledger.note_award(place, message, winner, input.now);
                }
                if winner == self.me.robot {
                    self.bidder
                        .receive_renewal(place, message, &offers[place], input.now, answers);
                }
            }
            NegotiationKind::Ack { status, progress } => {
                self.auctioneer
                    .note_auctioneer(place, message.auction.auctioneer, input.now);
                let continues = status == ContractStatus::Ongoing;
                if !continues || !self.auctioneer.is_banned(place, sender, input.now) {
                    let progress = continues.then_some(progress);
                    self.ledger
                        .note_ack(place, message, sender, progress, input.now);
                }
            }
        }
    }
}
