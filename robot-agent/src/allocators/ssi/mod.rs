//! SSI: sequential single-item auctions (Lagoudakis et al., RSS 2005; Koenig et al., AAAI 2006;
//! docs/allocators/ssi.md). In each auction every robot bids for the task that is cheapest for it by the team objective,
//! and the lowest bid wins one task. The next auction follows at once, until no robot bids. There is no auctioneer: bids
//! are broadcast, and all robots determine the winner.
//!
//! - `path`: the path of a robot, and the cost of one more task by cheapest insertion.
//! - `awards`: the holder of each task, and the merging of teammates' awards.
//! - `auction`: the bids of the current auction, and its end. `config`: the parameters.

mod auction;
mod awards;
mod config;
mod path;
#[cfg(test)]
mod tests;

use proto::allocation::AllocationMessage;
use proto::allocation::ssi::{AuctionBid, Award, CostBid};
use proto::team::BroadcastContent;
use proto::telemetry::Reason;
use scenario::ParameterSpec;
use scenario::ids::{BehaviorId, TaskId};
use scenario::time::SimTime;

use crate::allocator::unit::WorkUnit;
use crate::allocator::utility::{COMMIT, best};
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState};
use crate::broken::is_broken;
use auction::{Arrival, Auction};
use awards::{Awards, Holder};
pub use config::Config;
use path::{Insertion, Offer, Path, Stop};

#[derive(Clone, Debug)]
pub struct Ssi {
    me: SelfState,
    config: Config,
    unit: WorkUnit,
    awards: Awards,
    auction: Auction,
    path: Path,
    /// The best behavior for each of the robot's tasks, at the latest bid or change.
    offers: Vec<Option<Offer>>,
    /// The last sign of progress of the current unit, and the time at which the next one is overdue.
    overdue: Option<(SimTime, SimTime)>,
    /// The time of the first step of this incarnation.
    born: Option<SimTime>,
    /// The time at which the robot last repeated all its awards.
    repeated: Option<SimTime>,
}

impl Allocator for Ssi {
    type Config = Config;

    fn plans_sequences() -> bool {
        true
    }

    fn parameters() -> Vec<ParameterSpec> {
        Config::parameters()
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        let awards = Awards::new(me);
        Self {
            me: me.clone(),
            config: *config,
            unit: WorkUnit::default(),
            offers: vec![None; awards.tasks().len()],
            awards,
            auction: Auction::default(),
            path: Path::default(),
            overdue: None,
            born: None,
            repeated: None,
        }
    }

    fn adopt(&mut self, config: &Config) -> bool {
        self.config = *config;
        true
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let before = decision.active;
        let first_before = self.path.stops.first().copied();
        let must_choose = self.unit.update(&self.me, input, before);
        self.awards.apply_rounds(input.choices);
        if self.receive(input) {
            self.give_back_plan();
        }
        let is_outbid = self.drop_lost();
        self.drop_overdue(input, before);
        if must_choose {
            self.weigh(input);
            self.drop_impossible();
        }
        let fixed = self.fixed(before);
        if must_choose {
            if fixed == 0 {
                self.path.sort();
            }
            self.drop_late(input);
        }

        let has_begun = self.conduct(input, fixed);
        if self.awards.take_changed() || must_choose || has_begun {
            self.update_bid(input, fixed);
        }
        self.send(input.now, &mut decision.say);

        let first = self.path.stops.first().copied();
        if must_choose || first != first_before {
            decision.active = self.choose(input, before, fixed);
        }
        if decision.active != before {
            decision.reason = Some(if is_outbid {
                Reason::Outbid
            } else if first.is_some() {
                Reason::Awarded
            } else {
                Reason::Claimed
            });
        }
        let holder = |task| self.awards.holder(task);
        let under_way = self.unit.under_way();
        under_way.log(&self.me, input, decision, holder);
        self.unit.note_active(before, decision.active, input.now);
        self.expect_progress();
    }
}

impl Ssi {
    /// Receives messages and removes silent robots. Returns whether a robot was added.
    fn receive(&mut self, input: &Input<'_>) -> bool {
        let (now, tau) = (input.now, self.me.ceased_after);
        let step = SimTime::from_secs_f64(self.me.step_s).0.max(1);
        let mut has_newcomer = false;
        for broadcast in input.received {
            let (sender, sent) = (broadcast.sender, broadcast.sent);
            let is_fresh = sent <= now && now.since(sent) < tau;
            if !self.me.is_teammate(sender) || !is_fresh {
                continue;
            }
            if let BroadcastContent::Allocation(AllocationMessage::Ssi(message)) = &broadcast.body {
                // An auction takes at least one step.
                let is_sound = u64::from(message.auction) <= now.0 / step + 1;
                let number = (broadcast.incarnation, broadcast.seq);
                let arrival = if is_sound {
                    self.auction.receive(sender, number, sent, message)
                } else {
                    Arrival::Old
                };
                if arrival == Arrival::Newcomer {
                    has_newcomer = true;
                    // A new incarnation inherits nothing.
                    self.awards.remove_holder(sender);
                }
                if arrival != Arrival::Old {
                    self.awards.receive(sender, message, now);
                }
            }
            self.auction.note_seen(sender, sent);
        }
        while let Some(lost) = self.auction.remove_silent(now, tau) {
            if !is_broken("ssi-keeps-awards-of-lost-robots") {
                self.awards.remove_holder(lost);
            }
        }
        has_newcomer
    }

    /// Returns a stop to the auctions.
    fn give_back(&mut self, stop: &Stop) {
        if self.awards.is_mine(stop.place) {
            self.awards.set(stop.place, None);
        }
    }

    /// Returns all tasks but the current one to the auctions, for a new robot.
    fn give_back_plan(&mut self) {
        while self.path.stops.len() > 1
            && let Some(stop) = self.path.stops.pop()
        {
            self.give_back(&stop);
        }
    }

    /// Removes the stops that another robot holds. Returns whether the first one is among them.
    fn drop_lost(&mut self) -> bool {
        let awards = &self.awards;
        let is_lost = |stop: &Stop| !awards.is_mine(stop.place);
        let first = self.path.stops.first().filter(|stop| is_lost(stop));
        let is_outbid = first.is_some_and(|stop| awards.place(stop.place).holder.is_some());
        self.path.stops.retain(|stop| !is_lost(stop));
        is_outbid
    }

    /// Returns the current task to the auctions if its unit takes [`COMMIT`] longer than estimated. The robot may not get
    /// there, and another may.
    fn drop_overdue(&mut self, input: &Input<'_>, active: Option<BehaviorId>) {
        let since = self.unit.under_way().since();
        let is_overdue = self
            .overdue
            .is_some_and(|(begun, at)| since == Some(begun) && input.now >= at);
        let Some(first) = self.path.stops.first().copied().filter(|_| is_overdue) else {
            return;
        };
        let is_current = active.and_then(|active| self.me.task_of(active)) == Some(first.task);
        if is_current && !input.is_laden {
            self.path.stops.remove(0);
            self.give_back(&first);
        }
    }

    /// Notes when the next progress is overdue: [`COMMIT`] after the estimated end of the unit that begins.
    fn expect_progress(&mut self) {
        let since = self.unit.under_way().since();
        if since == self.overdue.map(|(begun, _)| begun) {
            return;
        }
        let task = self.path.stops.first().map(|stop| stop.task);
        let offer = task.and_then(|task| self.offer(task));
        self.overdue = since.zip(offer).map(|(begun, offer)| {
            let estimate = SimTime::from_secs_f64(offer.cost_s);
            (begun, begun + estimate + COMMIT)
        });
    }

    /// Returns the stops to the auctions that are not applicable or have no known cost.
    fn drop_impossible(&mut self) {
        for stop in self.path.stops.clone() {
            if self.offer(stop.task).is_none() {
                self.path.stops.retain(|other| *other != stop);
                self.give_back(&stop);
            }
        }
    }

    /// Returns the stops to the auctions that can no longer be done in time after the earlier ones.
    fn drop_late(&mut self, input: &Input<'_>) {
        let mut path = std::mem::take(&mut self.path);
        let removed = path.remove_impossible(&self.seconds(input));
        self.path = path;
        for stop in removed {
            self.give_back(&stop);
        }
    }

    fn offer(&self, task: TaskId) -> Option<Offer> {
        self.offers[self.awards.own(task)?]
    }

    /// Stores the behavior of the highest utility for each task, the first of equal ones.
    fn weigh(&mut self, input: &Input<'_>) {
        let committed = self.unit.committed();
        self.offers.fill(None);
        for choice in input.choices {
            let utility = committed.utility(choice, input);
            let (Some(own), Some(utility)) = (self.awards.own(choice.task), utility) else {
                continue;
            };
            let Some(cost_s) = choice.cost_s else {
                continue;
            };
            if self.offers[own].is_none_or(|other| utility > other.utility) {
                self.offers[own] = Some(Offer {
                    behavior: choice.behavior,
                    reward: choice.reward,
                    cost_s,
                    utility,
                });
            }
        }
    }

    /// Returns the number of stops that stay in front: 1 while the first unit is under way.
    fn fixed(&self, active: Option<BehaviorId>) -> usize {
        let task = active.and_then(|active| self.me.task_of(active));
        let first = self.path.stops.first().map(|stop| stop.task);
        usize::from(self.unit.should_continue() && task.is_some() && first == task)
    }

    /// Returns the time for a task after other tasks. The first task has the cost of its best behavior.
    fn seconds<'a>(
        &'a self,
        input: &'a Input<'_>,
    ) -> impl Fn(&[TaskId], TaskId) -> Option<f64> + 'a {
        |after, task| {
            if after.is_empty() {
                self.offer(task).map(|offer| offer.cost_s)
            } else {
                (input.seconds)(after, task)
            }
        }
    }

    fn insertion(&self, own: usize, input: &Input<'_>, fixed: usize) -> Option<Insertion> {
        let task = &self.awards.tasks()[own];
        let seconds = self.seconds(input);
        let key = (task.task, task.priority);
        self.path
            .insertion(self.config.objective, key, fixed, &seconds)
    }

    /// Ends the current auction if it is over, or if a teammate is further, and begins the next. Returns whether it
    /// did.
    fn conduct(&mut self, input: &Input<'_>, fixed: usize) -> bool {
        let now = input.now;
        let span = SimTime::from_secs_f64;
        // A bid, its answer and the receipt of the answer take three steps.
        let window = span(self.config.bid_window_s).max(span(3.0 * self.me.step_s));
        let born = *self.born.get_or_insert(now);
        let is_young = now.since(born) < self.me.ceased_after;
        let waits_for_unknown = is_young && self.auction.bidders() + 1 < self.me.team;
        let me = self.me.robot;
        let latest = self.auction.latest();
        let is_over = self.auction.is_over(me, now, window, waits_for_unknown);
        if !is_over && latest <= self.auction.number {
            return false;
        }
        self.award(input, fixed);
        let next = self.auction.number.saturating_add(u32::from(is_over));
        self.auction.begin(next.max(latest), now);
        true
    }

    /// Awards the task of the best bid.
    fn award(&mut self, input: &Input<'_>, fixed: usize) {
        let awards = &self.awards;
        let is_free = |bid: &CostBid| {
            let place = awards.find(bid.task, bid.slot);
            place.is_none_or(|place| awards.place(place).holder.is_none())
        };
        let winner = self.auction.winner(self.me.robot, &self.me.briefs, is_free);
        let Some((robot, bid)) = winner else { return };
        let (Some(own), Some(place)) = (awards.own(bid.task), awards.find(bid.task, bid.slot))
        else {
            return;
        };
        if robot == self.me.robot {
            // The path may have changed since the bid.
            self.weigh(input);
            let Some(insertion) = self.insertion(own, input, fixed) else {
                return;
            };
            let stop = Stop {
                task: bid.task,
                priority: self.awards.tasks()[own].priority,
                place,
            };
            self.path.stops.insert(insertion.at, stop);
        }
        let award = Award {
            round: self.awards.place(place).round,
            auction: self.auction.number,
            bid,
        };
        self.awards.set(place, Some(Holder { robot, award }));
    }

    /// Keeps the bid while its task is possible and free, and else bids for the best task.
    fn update_bid(&mut self, input: &Input<'_>, fixed: usize) {
        let is_valid = self.auction.bid.is_some_and(|bid| {
            let place = self.awards.find(bid.task, bid.slot);
            place.is_some_and(|place| self.awards.place(place).holder.is_none())
                && self.offer(bid.task).is_some()
        });
        if is_valid {
            return;
        }
        let bid = self.best_bid(input, fixed);
        if bid != self.auction.bid {
            self.auction.set_bid(bid);
        }
    }

    /// Returns the bid for the cheapest task: the highest priority, then the lowest cost and task.
    fn best_bid(&mut self, input: &Input<'_>, fixed: usize) -> Option<CostBid> {
        let has_work = |own: usize| self.awards.free_place(own).is_some();
        if !(0..self.offers.len()).any(has_work) {
            return None;
        }
        self.weigh(input);
        self.drop_late(input);
        if self.path.stops.len() >= self.config.path_max {
            return None;
        }
        let mut best: Option<(i32, CostBid)> = None;
        for own in 0..self.offers.len() {
            let (Some(offer), Some(place)) = (self.offers[own], self.awards.free_place(own)) else {
                continue;
            };
            let Some(insertion) = self.insertion(own, input, fixed) else {
                continue;
            };
            let priority = self.awards.tasks()[own].priority;
            let bid = CostBid {
                task: self.awards.place(place).task,
                slot: self.awards.place(place).slot,
                cost: cost(insertion.cost_s, offer.reward),
            };
            let is_better = |&(other_priority, other): &(i32, CostBid)| {
                priority > other_priority || (priority == other_priority && bid.cost < other.cost)
            };
            if best.as_ref().is_none_or(is_better) {
                best = Some((priority, bid));
            }
        }
        best.map(|(_, bid)| bid)
    }

    /// Sends a new bid, an answer or changed awards at once, and all awards every 1/ρ.
    fn send(&mut self, now: SimTime, messages: &mut Vec<AllocationMessage>) {
        let is_late = |repeated| now.since(repeated) >= self.me.heartbeat_period;
        let is_due = self.repeated.is_none_or(is_late);
        if is_due {
            self.awards.mark_own_unsent();
            self.repeated = Some(now);
        }
        let must_send = is_due || !self.auction.is_sent() || self.auction.needs_answer();
        // The remaining blocks are sent in the next step.
        while messages.len() <= self.awards.tasks().len() {
            let Some(block) = self
                .awards
                .take_unsent()
                .or((must_send && messages.is_empty()).then_some(0))
            else {
                break;
            };
            messages.push(AllocationMessage::Ssi(AuctionBid {
                auction: self.auction.number,
                bid: self.auction.bid,
                block,
                awards: self.awards.of_block(block),
            }));
        }
        if !messages.is_empty() {
            self.auction.note_sent(now);
        }
    }

    /// Returns the behavior of the first stop, or of a task for all robots at once if the path is empty or less urgent.
    /// A unit under way is finished first.
    fn choose(
        &self,
        input: &Input<'_>,
        before: Option<BehaviorId>,
        fixed: usize,
    ) -> Option<BehaviorId> {
        let first = self.path.stops.first();
        let planned = first.and_then(|stop| self.offer(stop.task));
        let is_open = |choice: &Choice| {
            let own = self.awards.own(choice.task);
            own.is_some_and(|own| self.awards.tasks()[own].slots == 0)
        };
        let open = best(&self.unit.committed(), self.me.robot, input, is_open);
        let Some(((choice, _), stop)) = open.zip(first) else {
            let open = open.map(|(choice, _)| choice.behavior);
            return planned.map(|offer| offer.behavior).or(open);
        };
        let is_under_way = self.unit.should_continue() && before == Some(choice.behavior);
        let is_open_first =
            choice.priority > stop.priority || (is_under_way && choice.priority == stop.priority);
        if is_open_first && fixed == 0 {
            return Some(choice.behavior);
        }
        planned.map(|offer| offer.behavior)
    }
}

/// Converts a cost to a bid: seconds per unit of reward, finite and not negative for any mission.
fn cost(cost_s: f64, reward: f64) -> f32 {
    let per_reward = cost_s / reward.max(f64::MIN_POSITIVE);
    (per_reward as f32).min(f32::MAX)
}
