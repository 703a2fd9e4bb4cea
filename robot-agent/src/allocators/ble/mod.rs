//! BLE, broadcast of local eligibility (Werger and Matarić, DARS 2000; docs/allocators/ble.md). Each robot broadcasts a
//! row: its eligibility for each task. All robots compute the same greedy assignment from the rows, again whenever a
//! row changes.
//!
//! # Decisions beyond the paper
//! - The table contains the rows as last broadcast, the robot's own row too, so that all robots decide from the same
//!   numbers. With a fresher own row, two robots could each rank first.
//! - A unit counts as under way (u = r) from the third step after activation. By then robots that started in the same
//!   step have exchanged their rows, so that the nearest one stays.
//! - The first row of a new or returning robot is answered at once. Newcomers and healed partitions then receive the
//!   current assignment within two steps instead of 1/ρ.
//! - A row is valid for τ after its receipt. Entries for unknown tasks, of future rounds or without a finite utility
//!   are ignored.

mod table;
#[cfg(test)]
mod tests;

use proto::allocation::AllocationMessage;
use proto::allocation::ble::{ELIGIBLE_MAX, Eligibility};
use proto::team::BroadcastContent;
use proto::telemetry::Reason;
use scenario::ParameterRange::{Above, Flag};
use scenario::ParameterSpec;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::offers::{Offers, weigh};
use crate::allocator::utility::WorkInProgress;
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState, parameters};
use crate::broken::is_broken;
use table::{Table, Update};

/// The number of steps after activation before a unit counts as under way.
const SETTLED: u8 = 2;

#[derive(Clone, Debug)]
pub struct Ble {
    me: SelfState,
    period: SimTime,
    ceased_after: SimTime,
    commit: bool,
    under_way: WorkInProgress,
    table: Table,
    /// The number of steps for which the task has been the same, at most [`SETTLED`].
    unchanged: u8,
    last_sent: Option<SimTime>,
    /// The earliest time at which a row can expire.
    next_expiry: SimTime,
    task: Option<TaskId>,
    /// The assigned robot for the task of each behavior, in the order of [`SelfState::behaviors`].
    holders: SmallVec<[Option<RobotId>; 6]>,
    /// The tasks that the robot could start in this step, the best first.
    offers: Offers,
}

parameters! {
    /// The parameters in `[allocators.ble]`.
    pub struct Config {
        rate_hz: f64 = 1.0, "Hz", Above(0.0, 1000.0),
            "rate at which a robot repeats its eligibilities (rho; the paper's rates are not known)";
        ceased_after_s: f64 = 5.0, "s", Above(0.0, 1e9),
            "silence after which a teammate's eligibilities expire (tau, as in ALLIANCE)";
        commit: bool = true, "", Flag,
            "whether a unit under way keeps its whole utility; if not, a nearer newcomer takes over, as in the paper";
    }
}

impl Allocator for Ble {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        Config::parameters()
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        Self {
            me: me.clone(),
            period: SimTime::from_secs_f64(1.0 / config.rate_hz),
            ceased_after: SimTime::from_secs_f64(config.ceased_after_s),
            commit: config.commit,
            under_way: WorkInProgress::default(),
            table: Table::default(),
            last_sent: None,
            next_expiry: SimTime::ZERO,
            unchanged: 0,
            task: None,
            holders: SmallVec::new(),
            offers: SmallVec::new(),
        }
    }

    fn adopt(&mut self, config: &Config) -> bool {
        self.period = SimTime::from_secs_f64(1.0 / config.rate_hz);
        self.ceased_after = SimTime::from_secs_f64(config.ceased_after_s);
        self.commit = config.commit;
        // The rows expire at other times.
        self.next_expiry = SimTime::ZERO;
        true
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let before = decision.active;
        self.under_way.record_progress(&self.me, input);
        self.weigh(input);

        let news = self.receive(input);
        let mut has_changed = self.drop_expired(input.now) || news.changed;
        let is_due = self
            .last_sent
            .is_none_or(|sent| input.now.since(sent) >= self.period);
        if is_due || news.is_newcomer || !self.has_broadcast_this_order() {
            self.update_row(input.now, decision);
            has_changed = true;
        }
        if has_changed {
            self.assign();
        }
        decision.active = self.behavior();
        if decision.active == before {
            self.unchanged = (self.unchanged + 1).min(SETTLED);
        } else {
            self.unchanged = 0;
            decision.reason = self.reason(before);
            if decision.say.is_empty() {
                // Repeat the row on which the decision is based, for teammates that missed it.
                self.broadcast_row(input.now, decision);
            }
        }
        let holder = |task| self.holder_of(task);
        self.under_way.log(&self.me, input, decision, holder);
        let settled = decision.active.filter(|_| self.unchanged == SETTLED);
        if self.commit {
            self.under_way.record_active(settled, input.now);
        }
    }
}

impl Ble {
    fn weigh(&mut self, input: &Input<'_>) {
        let utility_of = |choice: &Choice| Some(self.under_way.utility(choice, input)? as f32);
        let (robot, choices) = (self.me.robot, input.choices);
        weigh(&mut self.offers, robot, choices, ELIGIBLE_MAX, utility_of);
    }

    fn receive(&mut self, input: &Input<'_>) -> Update {
        let mut all = Update::default();
        for broadcast in input.received {
            let BroadcastContent::Allocation(AllocationMessage::Ble(eligibility)) = &broadcast.body
            else {
                continue;
            };
            let robot = broadcast.sender;
            if !self.me.is_teammate(robot) {
                continue;
            }
            let entries = eligibility.entries.iter().copied().take(ELIGIBLE_MAX);
            let sound = entries.filter(|entry| {
                entry.task.index() < self.me.tasks
                    && entry.round <= input.now
                    && entry.utility.is_finite()
            });
            let stamp = (broadcast.incarnation, broadcast.seq);
            let news = self.table.receive(robot, stamp, sound, input.now);
            all.changed |= news.changed;
            all.is_newcomer |= news.is_newcomer;
        }
        all
    }

    /// Drops rows older than τ. Returns whether there were any.
    fn drop_expired(&mut self, now: SimTime) -> bool {
        if now < self.next_expiry || now < self.ceased_after || is_broken("ble-rows-never-age") {
            return false;
        }
        let (has_changed, oldest) = self
            .table
            .drop_older(now - self.ceased_after, self.me.robot);
        self.next_expiry = oldest.unwrap_or(now) + self.ceased_after;
        has_changed
    }

    /// Returns whether the last broadcast lists the robot's tasks in the current order.
    fn has_broadcast_this_order(&self) -> bool {
        let row = self.table.row(self.me.robot).iter();
        let offers = self.offers.iter().map(|offer| &offer.entry);
        row.map(|entry| (entry.task, entry.round))
            .eq(offers.map(|entry| (entry.task, entry.round)))
    }

    /// Replaces the robot's row by the current offers and broadcasts it.
    fn update_row(&mut self, now: SimTime, decision: &mut Decision) {
        let entries = self.offers.iter().map(|offer| offer.entry);
        self.table.set_row_of(self.me.robot, entries);
        self.broadcast_row(now, decision);
    }

    fn broadcast_row(&mut self, now: SimTime, decision: &mut Decision) {
        self.last_sent = Some(now);
        decision.say.push(AllocationMessage::Ble(Eligibility {
            entries: self.table.row(self.me.robot).into(),
        }));
    }

    fn assign(&mut self) {
        self.table.assign(&self.me.briefs);
        self.task = self.table.task_of(self.me.robot);
        if is_broken("ble-ignores-other-rows") {
            self.task = self.offers.first().map(|offer| offer.entry.task);
        }
        let mut others = (0..self.me.team as u32)
            .map(RobotId)
            .filter(|robot| *robot != self.me.robot);
        if is_broken("ble-waits-for-a-row") && others.all(|robot| self.table.row(robot).is_empty())
        {
            self.task = None;
        }
        self.holders.clear();
        for own in &self.me.behaviors {
            self.holders.push(self.table.holder_of(own.task));
        }
    }

    fn holder_of(&self, task: TaskId) -> Option<RobotId> {
        let mut own = self.me.behaviors.iter().zip(&self.holders);
        own.find(|(own, _)| own.task == task)
            .and_then(|(_, &holder)| holder)
    }

    fn behavior(&self) -> Option<BehaviorId> {
        let task = self.task?;
        let mut offers = self.offers.iter();
        let offer = offers.find(|offer| offer.entry.task == task)?;
        Some(offer.behavior)
    }

    fn reason(&self, before: Option<BehaviorId>) -> Option<Reason> {
        let mut offers = self.offers.iter();
        let Some(left) = offers.find(|offer| Some(offer.behavior) == before) else {
            return Some(Reason::Claimed);
        };
        let holder = self.holder_of(left.entry.task);
        holder
            .filter(|&robot| robot != self.me.robot)
            .map(|_| Reason::Outbid)
    }
}
