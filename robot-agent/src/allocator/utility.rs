//! Utility, as all rules that compare costs measure it (ALLOCATORS.md §1).
//!
//! u = r·λ^cost, λ = 0.98/s; u = r while a unit is under way, since activation or the last progress, for at most
//! [`COMMIT`]; 2r while carrying. So what has been begun is finished, and a claim that leads to nothing loses its bonus. λ and
//! the commitment are the same for all allocators and never tuned for one of them.

use std::cmp::Ordering;

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::telemetry::{AllocationRow, BehaviorState};
use alliance_proto::time::SimTime;

use super::{Choice, Decision, Input, Me};

/// λ, per second of cost.
pub const DISCOUNT_PER_S: f64 = 0.98;

/// How long a unit that is under way keeps its bonus without progress.
pub const COMMIT: SimTime = SimTime(60_000);

/// What a robot is at, for the bonus of what has been begun.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnderWay(Option<(BehaviorId, SimTime)>);

impl UnderWay {
    /// Takes note of the progress of a step; at its beginning.
    pub fn note_progress(&mut self, me: &Me, input: &Input<'_>) {
        if let Some((behavior, since)) = &mut self.0
            && let Some(own) = me.behaviors.iter().find(|own| own.id == *behavior)
            && input.progressed.contains(&own.task)
        {
            *since = input.now;
        }
    }

    /// Takes note of what is active after a step.
    pub fn note_active(&mut self, active: Option<BehaviorId>, now: SimTime) {
        if self.0.map(|(behavior, _)| behavior) != active {
            self.0 = active.map(|behavior| (behavior, now));
        }
    }

    /// Since when it has been at it without progress; `None` if it is at nothing.
    #[must_use]
    pub fn since(&self) -> Option<SimTime> {
        self.0.map(|(_, since)| since)
    }

    /// Utility of a choice; `None` if it is not applicable or its cost not known.
    #[must_use]
    pub fn utility(&self, choice: &Choice, input: &Input<'_>) -> Option<f64> {
        if !choice.applicable {
            return None;
        }
        let cost_s = choice.cost_s?;
        let bonus = match self.0 {
            Some((behavior, since)) if behavior == choice.behavior => {
                if input.is_laden {
                    Some(2.0)
                } else {
                    (input.now.since(since) < COMMIT).then_some(1.0)
                }
            }
            _ => None,
        };
        Some(choice.reward * bonus.unwrap_or_else(|| libm::pow(DISCOUNT_PER_S, cost_s)))
    }
}

/// A claim to a task by its worth, in the one order that all rules have: larger priority, larger utility, lower rank, lower task.
/// [`Ordering::Greater`] is the better one; none is equal to another robot's or another task's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bid {
    /// Priority of the task.
    pub priority: i32,
    /// Utility.
    pub utility: f64,
    /// Whose bid it is.
    pub robot: RobotId,
    /// For which task.
    pub task: TaskId,
}

impl Bid {
    /// Which of two bids goes first.
    #[must_use]
    pub fn order(&self, other: &Self) -> Ordering {
        self.priority
            .cmp(&other.priority)
            .then(self.utility.total_cmp(&other.utility))
            .then(other.robot.cmp(&self.robot))
            .then(other.task.cmp(&self.task))
    }
}

/// The best applicable choice, by priority, utility and task.
#[must_use]
pub fn best<'a>(
    under_way: &UnderWay,
    robot: RobotId,
    input: &'a Input<'_>,
    mut may: impl FnMut(&Choice) -> bool,
) -> Option<(&'a Choice, f64)> {
    let mut best: Option<(&Choice, Bid)> = None;
    for choice in input.choices {
        let Some(utility) = under_way.utility(choice, input) else {
            continue;
        };
        let bid = Bid {
            priority: choice.priority,
            utility,
            robot,
            task: choice.task,
        };
        // Of two behaviors for one task with the same utility the first stays.
        let is_better = best
            .as_ref()
            .is_none_or(|(_, other)| bid.order(other) == Ordering::Greater);
        if is_better && may(choice) {
            best = Some((choice, bid));
        }
    }
    best.map(|(choice, bid)| (choice, bid.utility))
}

impl UnderWay {
    /// Writes a row per applicable choice: its utility, who has the task according to `holder`, and whether the robot is at it.
    pub fn log(
        &self,
        me: &Me,
        input: &Input<'_>,
        decision: &mut Decision,
        holder: impl Fn(TaskId) -> Option<RobotId>,
    ) {
        for choice in input.choices.iter().filter(|choice| choice.applicable) {
            let is_active = decision.active == Some(choice.behavior);
            decision.rows.push(AllocationRow {
                task: choice.task,
                behavior: choice.behavior,
                utility: self.utility(choice, input).unwrap_or(0.0),
                holder: if is_active {
                    Some(me.robot)
                } else {
                    holder(choice.task)
                },
                state: if is_active {
                    BehaviorState::Active
                } else {
                    BehaviorState::Hibernating
                },
            });
        }
    }
}
