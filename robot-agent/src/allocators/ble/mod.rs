//! BLE, broadcast of local eligibility (Werger and Matarić, DARS 2000): each robot says how eligible it is for each task, and
//! does what the best pairs of robots and tasks, taken one after the other, leave it. No roles, no bids, no contracts: the same
//! is decided anew whenever a row changes. docs/allocators/ble.md.
//!
//! # Decided here
//! - In the table stands what a robot *said* last, its own row too: so all that hear each other decide from the same numbers. If
//!   one's own row were always fresh, two robots could each believe to be the better one until both have spoken again.
//! - A unit counts as under way (u = r) from the third step after activation: by then the words of all who began in the same step
//!   have crossed, so that the nearest of them stays, not the one of the lowest rank; and a newcomer has its answers.
//! - A row of a robot of which nothing was known, or no more, is answered at once: a newcomer, and the other side of a partition
//!   that heals, hear within two steps what is under way, and not within 1/ρ.
//! - A row counts for τ after it was heard. Of what is heard, entries for tasks that there are not, of rounds to come and without a
//!   finite utility are left out.

mod table;
#[cfg(test)]
mod tests;

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::allocation::ble::{ELIGIBLE_MAX, Eligibility, Eligible};
use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use alliance_proto::team::Content;
use alliance_proto::telemetry::Reason;
use alliance_proto::time::SimTime;
use serde::Deserialize;
use smallvec::SmallVec;

use crate::allocator::utility::{Bid, UnderWay};
use crate::allocator::{Allocator, Choice, Decision, Input, Me};
use table::{News, Table};

/// Steps after activation before a unit counts as under way.
const SETTLED: u8 = 2;

/// One robot's choice.
#[derive(Clone, Debug)]
pub struct Ble {
    me: Me,
    period: SimTime,
    ceased_after: SimTime,
    commit: bool,
    under_way: UnderWay,
    table: Table,
    /// For how many steps its task has been the same, up to [`SETTLED`].
    unchanged: u8,
    /// When it spoke last; `None` before its first step.
    spoke: Option<SimTime>,
    /// Before then no row is too old.
    look_again: SimTime,
    /// Its task in the assignment.
    task: Option<TaskId>,
    /// Who has the task of each own behavior in the assignment, by place in [`Me::behaviors`].
    holders: SmallVec<[Option<RobotId>; 6]>,
    /// What it could begin in this step, the best first.
    offers: SmallVec<[Offer; 6]>,
}

/// `[allocators.ble]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// How often a robot repeats its row, Hz.
    pub rate_hz: f64,
    /// How long a row counts, s.
    pub ceased_after_s: f64,
    /// Whether what is under way is worth more than what is not.
    pub commit: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            rate_hz: 1.0,
            ceased_after_s: 5.0,
            commit: true,
        }
    }
}

/// The best own behavior for a task.
#[derive(Clone, Copy, Debug)]
struct Offer {
    behavior: BehaviorId,
    entry: Eligible,
    bid: Bid,
}

impl Allocator for Ble {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        let default = Config::default();
        vec![
            ParameterSpec {
                key: "rate_hz",
                unit: "Hz",
                default: ParameterDefault::Number(default.rate_hz),
                about: "how often a robot repeats what it is eligible for (rho; the paper's rates are not known to us)",
                range: ParameterRange::Above(0.0, 1000.0),
            },
            ParameterSpec {
                key: "ceased_after_s",
                unit: "s",
                default: ParameterDefault::Number(default.ceased_after_s),
                about: "silence after which a teammate is eligible for nothing (tau, as in ALLIANCE)",
                range: ParameterRange::Above(0.0, 1e9),
            },
            ParameterSpec {
                key: "commit",
                unit: "",
                default: ParameterDefault::Flag(default.commit),
                about: "whether a unit under way keeps its whole worth; without it the paper's opportunism: a nearer newcomer takes over",
                range: ParameterRange::Flag,
            },
        ]
    }

    fn new(me: &Me, config: &Config) -> Self {
        Self {
            me: me.clone(),
            period: SimTime::from_secs_f64(1.0 / config.rate_hz),
            ceased_after: SimTime::from_secs_f64(config.ceased_after_s),
            commit: config.commit,
            under_way: UnderWay::default(),
            table: Table::default(),
            spoke: None,
            look_again: SimTime::ZERO,
            unchanged: 0,
            task: None,
            holders: SmallVec::new(),
            offers: SmallVec::new(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let before = decision.active;
        self.under_way.note_progress(&self.me, input);
        self.weigh(input);

        let news = self.hear(input);
        let mut has_changed = self.forget(input.now) || news.changed;
        let is_due = self
            .spoke
            .is_none_or(|spoke| input.now.since(spoke) >= self.period);
        if is_due || news.newcomer || !self.has_said_this_order() {
            self.speak(input.now, decision);
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
                // Once more what all have decided from, for those who missed it.
                self.say(input.now, decision);
            }
        }
        let holder = |task| self.holder_of(task);
        self.under_way.log(&self.me, input, decision, holder);
        let settled = decision.active.filter(|_| self.unchanged == SETTLED);
        if self.commit {
            self.under_way.note_active(settled, input.now);
        }
    }
}

impl Ble {
    /// What the robot could begin in this step.
    fn weigh(&mut self, input: &Input<'_>) {
        self.offers.clear();
        for choice in input.choices {
            let Some(offer) = self.offer(choice, input) else {
                continue;
            };
            let mut known = self.offers.iter_mut();
            match known.find(|known| known.entry.task == choice.task) {
                // Of two behaviors with the same utility the first stays.
                Some(known) if offer.bid.utility > known.bid.utility => *known = offer,
                Some(_) => {}
                None => self.offers.push(offer),
            }
        }
        self.offers
            .sort_unstable_by(|one, other| other.bid.order(&one.bid));
        self.offers.truncate(ELIGIBLE_MAX);
    }

    fn offer(&self, choice: &Choice, input: &Input<'_>) -> Option<Offer> {
        // As it is said.
        let utility = self.under_way.utility(choice, input)? as f32;
        Some(Offer {
            behavior: choice.behavior,
            entry: Eligible {
                task: choice.task,
                round: choice.round,
                utility,
            },
            bid: Bid {
                priority: choice.priority,
                utility: f64::from(utility),
                robot: self.me.robot,
                task: choice.task,
            },
        })
    }

    fn hear(&mut self, input: &Input<'_>) -> News {
        let mut all = News::default();
        for broadcast in input.heard {
            let Content::Allocation(AllocationMessage::Ble(eligibility)) = &broadcast.body else {
                continue;
            };
            let robot = broadcast.sender;
            if robot == self.me.robot || robot.index() >= self.me.team {
                continue;
            }
            let entries = eligibility.entries.iter().copied().take(ELIGIBLE_MAX);
            let sound = entries.filter(|entry| {
                entry.task.index() < self.me.tasks
                    && entry.round <= input.now
                    && entry.utility.is_finite()
            });
            let word = (broadcast.incarnation, broadcast.seq);
            let news = self.table.hear(robot, word, sound, input.now);
            all.changed |= news.changed;
            all.newcomer |= news.newcomer;
        }
        all
    }

    /// Drops rows older than τ. Says whether there were any.
    fn forget(&mut self, now: SimTime) -> bool {
        if now < self.look_again || now < self.ceased_after {
            return false;
        }
        let (has_changed, oldest) = self
            .table
            .drop_older(now - self.ceased_after, self.me.robot);
        self.look_again = oldest.unwrap_or(now) + self.ceased_after;
        has_changed
    }

    /// Whether the order of the own utilities is the one that was said last.
    fn has_said_this_order(&self) -> bool {
        let said = self.table.row(self.me.robot).iter();
        let offers = self.offers.iter().map(|offer| &offer.entry);
        said.map(|entry| (entry.task, entry.round))
            .eq(offers.map(|entry| (entry.task, entry.round)))
    }

    /// Its row is what it could begin now, and all are told.
    fn speak(&mut self, now: SimTime, decision: &mut Decision) {
        let entries = self.offers.iter().map(|offer| offer.entry);
        self.table.set_own(self.me.robot, entries);
        self.say(now, decision);
    }

    fn say(&mut self, now: SimTime, decision: &mut Decision) {
        self.spoke = Some(now);
        decision.say.push(AllocationMessage::Ble(Eligibility {
            entries: self.table.row(self.me.robot).into(),
        }));
    }

    fn assign(&mut self) {
        self.table.assign(&self.me.briefs);
        self.task = self.table.task_of(self.me.robot);
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

    /// What the assignment leaves to this robot.
    fn behavior(&self) -> Option<BehaviorId> {
        let task = self.task?;
        let mut offers = self.offers.iter();
        let offer = offers.find(|offer| offer.entry.task == task)?;
        Some(offer.behavior)
    }

    /// Why the robot does something else than before.
    fn reason(&self, before: Option<BehaviorId>) -> Option<Reason> {
        let mut offers = self.offers.iter();
        let Some(left) = offers.find(|offer| Some(offer.behavior) == before) else {
            return Some(Reason::Claimed);
        };
        let holder = self.holder_of(left.entry.task);
        holder
            .filter(|&it| it != self.me.robot)
            .map(|_| Reason::Outbid)
    }
}
