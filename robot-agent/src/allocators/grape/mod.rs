//! GRAPE: a hedonic game in which selfish robots choose coalitions until no robot gains by a move (Jang, Shin,
//! Tsourdos, IEEE T-RO 34(6), 2018; docs/allocators/grape.md).
//!
//! By default a task is worth u/p to each member of a coalition of p robots, with utility u, and nothing above
//! `max_robots`. No task is worth 0. Tasks that robots must execute at the same time are one coalition, with a slot for
//! each robot: a complete one goes before others, and of the others the one with fewer missing robots.

mod coalitions;
mod partition;
mod published;
#[cfg(test)]
mod tests;

use std::cmp::Ordering;

use proto::allocation::AllocationMessage;
use proto::team::BroadcastContent;
use proto::telemetry::Reason;
use rand::RngExt;
use scenario::ParameterRange::{self, Above};
use scenario::ParameterSpec;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use serde::Deserialize;

use crate::allocator::unit::WorkUnit;
use crate::allocator::utility::log_choices;
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState, parameters};
use coalitions::Coalitions;
use partition::{PartReceiver, Partition};

#[derive(Clone, Debug)]
pub struct Grape {
    me: SelfState,
    refresh: SimTime,
    utility: Utility,
    unit: WorkUnit,
    coalitions: Coalitions,
    partition: Partition,
    inbox: PartReceiver,
    /// The teammates from which anything was received, by rank. Heartbeats count only as signs of life.
    met: Vec<RobotId>,
    last_sent: Option<SimTime>,
    /// The next part to send; `None` if all parts have been sent.
    next_part: Option<u16>,
}

parameters! {
    /// The parameters in `[allocators.grape]`.
    pub struct Config {
        refresh_s: f64 = 1.0, "s", Above(0.0, 1e9), "time between two broadcasts of the partition (decided here)";
        utility: Utility = Utility::Common => "common", "", ParameterRange::Choice(&["common", "published"]),
            "worth of a coalition: the common utility per member, or that of the published experiments";
    }
}

/// The worth of a coalition to a member.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Utility {
    /// The common utility of all allocators, divided by the number of members.
    Common,
    /// The utility of the published experiments.
    Published,
}

/// The value of a coalition to the robot: priority, then the number of missing robots, then utility.
#[derive(Clone, Copy, Debug)]
struct Worth {
    priority: i32,
    /// The number of slots without a robot; 0 for a task without slots.
    missing: usize,
    utility: f64,
}

impl Worth {
    fn order(&self, other: &Self) -> Ordering {
        let by_priority = self.priority.cmp(&other.priority);
        let by_missing = || other.missing.cmp(&self.missing);
        by_priority
            .then_with(by_missing)
            .then(self.utility.total_cmp(&other.utility))
    }
}

impl Grape {
    /// Receives messages and adopts the newest partition. Returns whether the partition changed.
    fn receive(&mut self, input: &Input<'_>) -> bool {
        let now = input.now;
        let mut has_changed = false;
        for broadcast in input.received {
            let (sender, sent) = (broadcast.sender, broadcast.sent);
            let is_fresh = sent <= now && now.since(sent) < self.me.ceased_after;
            if !self.me.is_teammate(sender) || !is_fresh {
                continue;
            }
            if let Err(at) = self.met.binary_search(&sender) {
                self.met.insert(at, sender);
            }
            if let BroadcastContent::Allocation(AllocationMessage::Partition(message)) =
                &broadcast.body
            {
                let size = (self.me.team, self.me.tasks);
                has_changed |= self.inbox.receive(message, &mut self.partition, size, now);
            }
            self.partition.record_sign_of_life(sender, sent);
        }
        has_changed
    }

    /// Removes robots without a sign of life for τ, direct or reported. Returns whether there were any.
    fn remove_silent(&mut self, input: &Input<'_>) -> bool {
        let has_met = |robot| self.met.binary_search(&robot).is_ok();
        self.partition
            .remove_silent(input.now, self.me.ceased_after, has_met)
    }

    /// Returns the value of a task to the robot with this behavior; `None` if it cannot join.
    fn worth(&self, choice: &Choice, input: &Input<'_>) -> Option<Worth> {
        let utility = self.unit.committed().utility(choice, input)?;
        let joined = self.coalitions.joined_task(choice.task);
        let missing = self
            .coalitions
            .missing_with(joined, &self.partition, self.me.robot)?;
        // Each member of a coalition with slots does work that no other member can do.
        let members = match self.coalitions.has_slots(joined) {
            true => 1,
            false => 1 + self.partition.other_members(joined, self.me.robot),
        };
        let utility = match self.utility {
            Utility::Common => utility / members as f64,
            Utility::Published => {
                let size = (self.me.team, self.coalitions.count());
                let worth = published::utility(choice.reward, choice.cost_s?, members, size);
                Some(worth).filter(|&worth| worth > 0.0)?
            }
        };
        (members <= choice.max_robots).then_some(Worth {
            priority: choice.priority,
            missing,
            utility,
        })
    }

    /// Moves to the best coalition if it is better than the current one. Returns whether the robot moved.
    fn decide(&mut self, input: &Input<'_>) -> bool {
        let current = self.partition.task_of(self.me.robot);
        let worth_of = |choice: &Choice| {
            let joined = self.coalitions.joined_task(choice.task);
            Some((self.worth(choice, input)?, joined))
        };
        let offers = || input.choices.iter().filter_map(worth_of);
        // Of equal value the lower task wins.
        let better = |a: (Worth, TaskId), b: (Worth, TaskId)| {
            let is_better = b.0.order(&a.0).then(a.1.cmp(&b.1)).is_gt();
            if is_better { b } else { a }
        };
        let best = offers().reduce(better);
        let mine = offers()
            .filter(|(_, task)| Some(*task) == current)
            .reduce(better);
        let moves = match (best, mine) {
            (Some(best), Some(mine)) => best.0.order(&mine.0).is_gt(),
            (Some(_), None) => true,
            (None, _) => current.is_some(),
        };
        if moves {
            let task = best.map(|(_, task)| task);
            self.partition.move_robot(self.me.robot, task, input.now);
        }
        moves
    }

    /// Returns the behavior of highest utility for the robot's task; the first of equal ones. In a coalition with slots, that
    /// of the robot's slot goes first, and that of another slot is for the case that its own is not applicable.
    fn behavior(&self, input: &Input<'_>) -> Option<BehaviorId> {
        let joined = self.partition.task_of(self.me.robot)?;
        let slot = self
            .coalitions
            .slot_of(joined, &self.partition, self.me.robot);
        let mut best: Option<((bool, f64), BehaviorId)> = None;
        for choice in input.choices {
            if self.coalitions.joined_task(choice.task) != joined {
                continue;
            }
            let Some(utility) = self.unit.committed().utility(choice, input) else {
                continue;
            };
            let value = (slot == Some(choice.task), utility);
            if best.is_none_or(|(most, _)| value > most) {
                best = Some((value, choice.behavior));
            }
        }
        best.map(|(_, behavior)| behavior)
    }

    /// Sends the partition when it has changed, and every `refresh_s`.
    fn send_partition(
        &mut self,
        has_changed: bool,
        now: SimTime,
        messages: &mut Vec<AllocationMessage>,
    ) {
        let is_due = |last_sent| now.since(last_sent) >= self.refresh;
        if has_changed || (self.next_part.is_none() && self.last_sent.is_none_or(is_due)) {
            self.next_part = Some(0);
            self.last_sent = Some(now);
        }
        self.partition.record_sign_of_life(self.me.robot, now);
        // The remaining parts are sent in the next step.
        while let Some(part) = self.next_part
            && messages.len() <= self.me.tasks
        {
            messages.push(AllocationMessage::Partition(self.partition.message(part)));
            self.next_part = Some(part + 1).filter(|&next| next < self.partition.parts());
        }
    }
}

impl Allocator for Grape {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        Config::parameters()
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        Self {
            me: me.clone(),
            refresh: SimTime::from_secs_f64(config.refresh_s),
            utility: config.utility,
            unit: WorkUnit::default(),
            coalitions: Coalitions::new(&me.briefs),
            partition: Partition::default(),
            inbox: PartReceiver::default(),
            met: Vec::new(),
            last_sent: None,
            next_part: None,
        }
    }

    fn adopt(&mut self, config: &Config) -> bool {
        // Robots decide again only after a change, so that another utility would leave an unstable partition.
        let is_same = config.utility == self.utility;
        if is_same {
            self.refresh = SimTime::from_secs_f64(config.refresh_s);
        }
        is_same
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let before = decision.active;
        let must_decide = self.unit.update(&self.me, input, before);
        let is_adopted = self.receive(input);
        let is_struck = self.remove_silent(input);
        let is_pushed_out = before.is_some() && self.partition.task_of(self.me.robot).is_none();
        let mut has_moved = is_struck;
        if must_decide || is_adopted || is_struck {
            has_moved |= self.decide(input);
        }
        if has_moved {
            self.partition.count_decision(input.draws.stream().random());
        }
        if must_decide || is_adopted || has_moved {
            decision.active = self.behavior(input);
        }
        if decision.active != before {
            decision.reason = Some(if is_pushed_out {
                Reason::Outbid
            } else {
                Reason::Claimed
            });
        }
        self.send_partition(is_adopted || has_moved, input.now, &mut decision.say);
        let holder = |task| self.coalitions.holder(task, &self.partition);
        match self.utility {
            Utility::Common => {
                let under_way = self.unit.under_way();
                under_way.log(&self.me, input, decision, holder);
            }
            Utility::Published => {
                let worth =
                    |choice: &Choice| self.worth(choice, input).map_or(0.0, |worth| worth.utility);
                log_choices(&self.me, input, decision, worth, holder);
            }
        }
        self.unit.note_active(before, decision.active, input.now);
    }
}
