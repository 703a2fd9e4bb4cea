//! MURDOCH (Gerkey and Matarić, AAAI 2000, T-RA 2002): tasks are auctioned. An auctioneer announces a task, robots that are free bid
//! what a unit by them is worth, the best bid gets a contract for a limited time, and the auctioneer renews it as long as the winner
//! answers. What is given is not given to a fitter one later. docs/allocators/murdoch.md.
//!
//! - `ledger`: the contracts that a robot knows of; everybody keeps it, so that whoever becomes auctioneer has it.
//! - `auctioneer`: announces, closes, renews. `bidder`: bids, works, answers.
//! - `mod.rs`: a step, and the words between them. A robot hears its own words one step later, as all others do: so it bids in its
//!   own auctions without a rule of its own.
//!
//! # Decided here
//! - The auctioneer of a task is the lowest-ranked robot heard within τ that has a behavior for it. Where a lower-ranked one is heard
//!   and says nothing about the task for τ + `lease_s`, although it is due, the next one takes the office all the same: the other
//!   may not know that it is due, or nobody may hear it say so.
//! - An Ack comes every 1/`renew_hz` by the winner's own clock, not in answer to each Renew: so a new auctioneer hears of a
//!   contract whose auctioneer has died.
//! - A contract ends `lease_s` after its latest Renew for the winner, and `lease_s` after its latest Ack for all others. What is said
//!   of how long it holds is not believed: `lease_s` is everybody's.
//! - Of two contracts for one place the one of the lower-ranked auctioneer holds; of the same auctioneer's, the later one.
//! - Auctions that close in the same step are awarded best bid first, so that nobody wins twice.
//! - Who carries something when its contract ends brings it away first, for at most [`COMMIT`](crate::allocator::utility::COMMIT).
//! - `progress_units` are units of the task as `alliance check` estimates them.

mod auctioneer;
mod bidder;
mod ledger;
#[cfg(test)]
mod tests;

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::allocation::murdoch::{Negotiation, Status, Word};
use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use alliance_proto::team::Content;
use alliance_proto::time::SimTime;
use serde::Deserialize;
use smallvec::SmallVec;

use crate::allocator::utility::UnderWay;
use crate::allocator::{Allocator, Choice, Decision, Input, Me};
use crate::by_rank::ByRank;
use auctioneer::Auctioneer;
use bidder::Bidder;
use ledger::Ledger;

/// One robot, in both its offices.
#[derive(Clone, Debug)]
pub struct Murdoch {
    me: Me,
    under_way: UnderWay,
    /// The own tasks, by id.
    tasks: SmallVec<[TaskId; 6]>,
    alive: ByRank<Life>,
    /// The latest word of each teammate, by place of the task.
    latest: SmallVec<[ByRank<(Incarnation, u64)>; 6]>,
    ledger: Ledger,
    auctioneer: Auctioneer,
    bidder: Bidder,
    /// What it said in the step before, and the memory of the one before that.
    own_words: Vec<Negotiation>,
    spare: Vec<Negotiation>,
}

/// What is known of a teammate's life.
#[derive(Clone, Copy, Debug, Default)]
struct Life {
    incarnation: Incarnation,
    /// When it was heard last.
    heard: SimTime,
}

/// `[allocators.murdoch]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// How long bids are taken, s.
    pub auction_s: f64,
    /// How often contracts are renewed and answered, Hz.
    pub renew_hz: f64,
    /// How long a contract lasts without that, s.
    pub lease_s: f64,
    /// Most auctions that an auctioneer has open at once.
    pub parallel: usize,
    /// What a contract is renewed for.
    pub monitor: Monitor,
    /// Time without progress after which it is not, in units of the task.
    pub progress_units: f64,
    /// For how long that robot does not get the task then, s.
    pub ban_s: f64,
}

/// What a contract is renewed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Monitor {
    /// That the winner answers.
    Ack,
    /// That it achieves something, too.
    Progress,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            auction_s: 0.5,
            renew_hz: 1.0,
            lease_s: 6.0,
            parallel: 8,
            monitor: Monitor::Ack,
            progress_units: 2.0,
            ban_s: 120.0,
        }
    }
}

/// The parameters, as they are used.
#[derive(Clone, Copy, Debug)]
struct Terms {
    /// Long enough for a bid to be heard.
    auction: SimTime,
    renew_every: SimTime,
    lease: SimTime,
    parallel: usize,
    monitor: Monitor,
    progress_units: f64,
    ban: SimTime,
    ceased_after: SimTime,
}

impl Terms {
    fn of(config: &Config, me: &Me) -> Self {
        let span = SimTime::from_secs_f64;
        // Announced, heard and bid, heard.
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
        let default = Config::default();
        let number = |key, unit, value, about, range| ParameterSpec {
            key,
            unit,
            default: ParameterDefault::Number(value),
            about,
            range,
        };
        let above = ParameterRange::Above;
        vec![
            number(
                "auction_s",
                "s",
                default.auction_s,
                "how long bids are taken, three steps at least (the TAlMech implementation: 0.5 and 1.5 s)",
                above(0.0, 1e6),
            ),
            number(
                "renew_hz",
                "Hz",
                default.renew_hz,
                "how often a contract is renewed, and answered (TAlMech: 1.5 and 2 Hz)",
                above(0.0, 1000.0),
            ),
            number(
                "lease_s",
                "s",
                default.lease_s,
                "how long a contract lasts when it is not (the paper's times are not known to us)",
                above(0.0, 1e6),
            ),
            ParameterSpec {
                key: "parallel",
                unit: "",
                default: ParameterDefault::Whole(default.parallel as i64),
                about: "most auctions that an auctioneer has open at once (TAlMech: 1 and 8)",
                range: ParameterRange::Whole(1, 10_000),
            },
            ParameterSpec {
                key: "monitor",
                unit: "",
                default: ParameterDefault::Text("ack"),
                about: "a contract is renewed for answers (ack), or for progress, too (decided here)",
                range: ParameterRange::Choice(&["ack", "progress"]),
            },
            number(
                "progress_units",
                "",
                default.progress_units,
                "with monitor = progress: time without progress that ends a contract, in units of the task's work (decided here)",
                above(0.0, 1e6),
            ),
            number(
                "ban_s",
                "s",
                default.ban_s,
                "for how long that robot does not get the task again (decided here)",
                ParameterRange::Within(0.0, 1e9),
            ),
        ]
    }

    fn new(me: &Me, config: &Config) -> Self {
        let mut tasks: SmallVec<[TaskId; 6]> = me.behaviors.iter().map(|own| own.task).collect();
        tasks.sort_unstable();
        tasks.dedup();
        let terms = Terms::of(config, me);
        Self {
            under_way: UnderWay::default(),
            alive: ByRank::default(),
            latest: tasks.iter().map(|_| ByRank::default()).collect(),
            ledger: Ledger::new(me, &tasks, terms),
            auctioneer: Auctioneer::new(me, &tasks, terms),
            bidder: Bidder::new(me, &tasks, terms),
            own_words: Vec::new(),
            spare: Vec::new(),
            tasks,
            me: me.clone(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.note_progress(&self.me, input);
        let mut said = std::mem::take(&mut self.spare);
        let offers = self.offers(input);

        for broadcast in input.heard {
            let sender = broadcast.sender;
            if sender == self.me.robot || sender.index() >= self.me.team {
                continue;
            }
            let life = self.alive.get_or_insert_with(sender, Life::default);
            life.heard = input.now;
            if broadcast.incarnation > life.incarnation {
                life.incarnation = broadcast.incarnation;
                // It knows nothing of what it had.
                self.ledger.end_all(sender);
            }
            if let Content::Allocation(AllocationMessage::Murdoch(negotiation)) = &broadcast.body {
                let word = (broadcast.incarnation, broadcast.seq);
                self.hear(sender, Some(word), negotiation, &offers, input, &mut said);
            }
        }
        let own_words = std::mem::take(&mut self.own_words);
        for negotiation in &own_words {
            self.hear(self.me.robot, None, negotiation, &offers, input, &mut said);
        }

        self.ledger.forget(input.now);
        self.bidder
            .act(&offers, input, &self.ledger, decision, &mut said);
        self.auctioneer.act(
            &offers,
            input,
            &self.me,
            &self.alive,
            &mut self.ledger,
            &mut said,
        );

        // What goes on is more urgent than what is to begin.
        said.sort_by_key(|it: &Negotiation| match it.word {
            Word::Ack { .. } => 0,
            Word::Renew { .. } => 1,
            Word::Announce { .. } => 2,
            Word::Bid { .. } => 3,
        });
        said.truncate(1 + self.tasks.len());
        let words = said.iter().copied().map(AllocationMessage::Murdoch);
        decision.say.extend(words);
        self.own_words = said;
        self.spare = own_words;
        self.spare.clear();

        let holder = |task| self.ledger.holder_of(self.place_of(task)?);
        self.under_way.log(&self.me, input, decision, holder);
        self.under_way.note_active(decision.active, input.now);
    }
}

/// What a robot could do about each of its tasks, by place.
type Offers<'a> = SmallVec<[Option<Offer<'a>>; 6]>;

/// The best own behavior for a task.
#[derive(Clone, Copy, Debug)]
struct Offer<'a> {
    choice: &'a Choice,
    /// As it is said; `None` where its cost is not known.
    utility: Option<f32>,
}

impl Murdoch {
    fn place_of(&self, task: TaskId) -> Option<usize> {
        self.tasks.binary_search(&task).ok()
    }

    /// The best applicable behavior for each task.
    fn offers<'a>(&self, input: &Input<'a>) -> Offers<'a> {
        let mut offers: Offers<'a> = self.tasks.iter().map(|_| None).collect();
        for choice in input.choices.iter().filter(|choice| choice.applicable) {
            let Some(place) = self.place_of(choice.task) else {
                continue;
            };
            let utility = self.under_way.utility(choice, input).map(|it| it as f32);
            // Of two behaviors with the same utility the first stays.
            if offers[place].is_none_or(|known: Offer<'_>| utility > known.utility) {
                offers[place] = Some(Offer { choice, utility });
            }
        }
        offers
    }

    /// A word, to whom it concerns. `number` tells it from others of its sender on that task; one's own come once.
    fn hear(
        &mut self,
        sender: RobotId,
        number: Option<(Incarnation, u64)>,
        said: &Negotiation,
        offers: &Offers<'_>,
        input: &Input<'_>,
        answers: &mut Vec<Negotiation>,
    ) {
        let Some(place) = self.place_of(said.task) else {
            return;
        };
        let is_void = offers[place].is_some_and(|offer| said.round < offer.choice.round);
        if said.round > input.now || is_void || said.auction.auctioneer.index() >= self.me.team {
            return;
        }
        if let Some(number) = number {
            let latest = self.latest[place].get_or_insert_with(sender, Default::default);
            if number <= *latest {
                return;
            }
            *latest = number;
        }
        match said.word {
            Word::Announce { closes } => {
                self.auctioneer.attended(place, sender, input.now);
                self.bidder
                    .invited(place, said, closes, &offers[place], input.now, answers);
            }
            Word::Bid { utility } => {
                self.auctioneer.bid(place, said.auction, sender, utility);
            }
            Word::Renew { winner } => {
                if winner.index() >= self.me.team {
                    return;
                }
                self.auctioneer.attended(place, sender, input.now);
                // Its own awards stand in its ledger, unless they have been given back since.
                if sender != self.me.robot {
                    self.ledger.note_award(place, said, winner, input.now);
                }
                if winner == self.me.robot {
                    self.bidder
                        .renewed(place, said, &offers[place], input.now, answers);
                }
            }
            Word::Ack { status, progress } => {
                self.auctioneer
                    .attended(place, said.auction.auctioneer, input.now);
                let goes_on = status == Status::Ongoing;
                if !goes_on || !self.auctioneer.is_banned(place, sender, input.now) {
                    let progress = goes_on.then_some(progress);
                    self.ledger
                        .note_ack(place, said, sender, progress, input.now);
                }
            }
        }
    }
}
