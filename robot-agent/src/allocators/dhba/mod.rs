//! DHBA: the decentralized Hungarian-based approach (Ismail, Sun, ICUAS 2017; docs/allocators/dhba.md). Each robot
//! broadcasts its row of the team's matrix and forwards the rows of others. All robots solve the same assignment
//! problem, and each takes its own task from the solution.
//!
//! - `matrix`: the rows that a robot has, with their versions, and their exchange.
//! - `assignment`: the part of the assignment that concerns the robot. The method is that of the oracle, shortest
//!   augmenting paths: `Plan`.

mod assignment;
mod matrix;
#[cfg(test)]
mod tests;

use proto::allocation::AllocationMessage;
use proto::allocation::ble::EligibleTask;
use proto::allocation::dhba::{MatrixPart, MatrixRow, ROW_ENTRIES_MAX, RowVersion};
use proto::team::BroadcastContent;
use proto::telemetry::Reason;
use scenario::ParameterRange::Above;
use scenario::ParameterSpec;
use scenario::ids::BehaviorId;
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::offers::{Offers, weigh};
use crate::allocator::unit::WorkUnit;
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState, parameters};
use crate::broken::is_broken;
use assignment::Assignment;
use matrix::{Matrix, Update};

parameters! {
    /// The parameters in `[allocators.dhba]`.
    pub struct Config {
        refresh_s: f64 = 1.0, "s", Above(0.0, 1e9),
            "time between two broadcasts of a robot's row and of the versions that it has; larger: fewer messages, but lost rows are repaired later; shorter than τ, or teammates count it as lost (decided here)";
    }
}

#[derive(Clone, Debug)]
pub struct Dhba {
    me: SelfState,
    refresh: SimTime,
    unit: WorkUnit,
    matrix: Matrix,
    /// The robot's offers at the latest change of its situation, the best first.
    offers: Offers,
    assignment: Assignment,
    repeated: Option<SimTime>,
}

impl Allocator for Dhba {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        Config::parameters()
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        Self {
            me: me.clone(),
            refresh: SimTime::from_secs_f64(config.refresh_s),
            unit: WorkUnit::default(),
            matrix: Matrix::default(),
            offers: SmallVec::new(),
            assignment: Assignment::new(me),
            repeated: None,
        }
    }

    fn adopt(&mut self, config: &Config) -> bool {
        self.refresh = SimTime::from_secs_f64(config.refresh_s);
        true
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let (before, me) = (decision.active, self.me.robot);
        let must_decide = self.unit.update(&self.me, input, before);
        let received = self.receive(input);
        let mut must_assign = received.is_of_concern;
        must_assign |= self
            .matrix
            .remove_silent(me, input.now, self.me.ceased_after);
        if must_decide {
            self.weigh(input);
            let entries: SmallVec<[EligibleTask; 6]> =
                self.offers.iter().map(|offer| offer.entry).collect();
            must_assign |= self.matrix.set_own(me, &entries, input.now);
        }
        if must_assign {
            self.assignment.update(&self.matrix, &self.me.briefs);
        }
        if received.has_changed || must_assign || must_decide {
            decision.active = self.behavior();
        }
        if decision.active != before {
            decision.reason = Some(self.reason(before));
        }
        let is_late = |repeated| input.now.since(repeated) >= self.refresh;
        if received.is_newcomer || self.repeated.is_none_or(is_late) {
            let period = input.now.0 / self.refresh.0.max(1);
            self.matrix.repeat(me, period);
            self.repeated = Some(input.now);
        }
        // The remaining rows are sent in the next step.
        while self.matrix.must_send() && decision.say.len() <= self.me.tasks {
            let part = self.matrix.next_part(me, input.now);
            decision.say.push(AllocationMessage::Dhba(part));
        }
        let holder = |task| self.assignment.holder(task);
        let under_way = self.unit.under_way();
        under_way.log(&self.me, input, decision, holder);
        self.unit.note_active(before, decision.active, input.now);
    }
}

impl Dhba {
    /// Receives rows and versions. Returns all effects on the matrix together.
    fn receive(&mut self, input: &Input<'_>) -> Update {
        let mut all = Update::default();
        let (now, tau) = (input.now, self.me.ceased_after);
        let is_fresh = |sent: SimTime| sent <= now && now.since(sent) < tau;
        for broadcast in input.received {
            let (sender, sent) = (broadcast.sender, broadcast.sent);
            if !self.me.is_teammate(sender) || !is_fresh(sent) {
                continue;
            }
            if let BroadcastContent::Allocation(AllocationMessage::Dhba(part)) = &broadcast.body {
                let MatrixPart { rows, versions } = part;
                let is_sound = |version: &RowVersion| {
                    self.me.is_teammate(version.robot)
                        && version.made.is_none_or(|made| made <= version.seen)
                        && is_fresh(version.seen)
                };
                let own = rows.iter().filter(|row| row.version.robot == self.me.robot);
                own.for_each(|row| self.matrix.correct_own(self.me.robot, row, now));
                let is_usable = |row: &&MatrixRow| {
                    is_sound(&row.version) && !is_broken("dhba-ignores-other-rows")
                };
                for row in rows.iter().filter(is_usable) {
                    let entries = row.entries.iter().copied().filter(|entry| {
                        entry.task.index() < self.me.tasks
                            && entry.round <= now
                            && entry.utility.is_finite()
                            && entry.utility >= 0.0
                    });
                    let direct = (row.version.robot == sender).then_some(sent);
                    let concerns = |old: &[EligibleTask], new: &[EligibleTask]| {
                        self.assignment.depends_on(old, new, &self.me.briefs)
                    };
                    let version = &row.version;
                    all |= self.matrix.receive_row(version, entries, direct, concerns);
                }
                for version in versions {
                    if !self.matrix.is_known(version) && is_sound(version) {
                        all.is_newcomer |= self.matrix.receive_version(version);
                    }
                }
            }
            self.matrix.note_seen(sender, sent);
        }
        all
    }

    /// Updates the offers. With n robots, one of the n best tasks of a robot is always free for it, so that more entries
    /// are never used in a team of that size.
    fn weigh(&mut self, input: &Input<'_>) {
        let utility_of = |choice: &Choice| {
            let utility = self.unit.committed().utility(choice, input)?;
            Some((utility as f32).clamp(0.0, f32::MAX))
        };
        let most = ROW_ENTRIES_MAX.min(self.me.team);
        let (robot, choices) = (self.me.robot, input.choices);
        weigh(&mut self.offers, robot, choices, most, utility_of);
    }

    fn behavior(&self) -> Option<BehaviorId> {
        let mut all = self.assignment.assigned().iter();
        let &(_, task) = all.find(|(robot, _)| *robot == self.me.robot)?;
        let mut offers = self.offers.iter();
        offers
            .find(|offer| offer.entry.task == task)
            .map(|offer| offer.behavior)
    }

    /// Returns `Outbid` if another robot has the task that the robot leaves.
    fn reason(&self, before: Option<BehaviorId>) -> Reason {
        let left = before.and_then(|before| self.me.task_of(before));
        let holder = left.and_then(|task| self.assignment.holder(task));
        if holder.is_some_and(|robot| robot != self.me.robot) {
            Reason::Outbid
        } else {
            Reason::Claimed
        }
    }
}
