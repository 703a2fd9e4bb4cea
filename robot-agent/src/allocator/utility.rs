//! The utility of a task, for all algorithms that compare costs.
//!
//! u = r·λ^cost, with λ = 0.98/s. While a unit is in progress, u = r for at most [`COMMIT`] since activation or the
//! last progress, and u = 2r while the robot carries an object. A robot thus finishes its work, and a claim without
//! progress loses its bonus. All allocators use the same λ and the same commitment.

use std::cmp::Ordering;

use proto::telemetry::{AllocationRow, BehaviorState};
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::{Choice, Decision, Input, SelfState};

/// λ, the discount per second of cost.
pub const DISCOUNT_PER_S: f64 = 0.98;

/// The time a unit in progress keeps its bonus without progress.
pub const COMMIT: SimTime = SimTime(60_000);

/// The behavior in progress and the time of its last progress, for the bonus in its utility.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkInProgress(Option<(BehaviorId, SimTime)>);

impl WorkInProgress {
    /// Records the progress of a step, at its start.
    pub fn record_progress(&mut self, me: &SelfState, input: &Input<'_>) {
        if let Some((behavior, since)) = &mut self.0
            && let Some(task) = me.task_of(*behavior)
            && input.progressed.contains(&task)
        {
            *since = input.now;
        }
    }

    /// Records the active behavior after a step.
    pub fn record_active(&mut self, active: Option<BehaviorId>, now: SimTime) {
        if self.0.map(|(behavior, _)| behavior) != active {
            self.0 = active.map(|behavior| (behavior, now));
        }
    }

    /// Returns the time of the last progress or of the activation; `None` for an idle robot.
    #[must_use]
    pub fn since(&self) -> Option<SimTime> {
        self.0.map(|(_, since)| since)
    }

    /// Returns the utility of a choice; `None` if it is not applicable or has no known cost.
    #[must_use]
    pub fn utility(&self, choice: &Choice, input: &Input<'_>) -> Option<f64> {
        if !choice.applicable {
            return None;
        }
        let cost_s = choice.cost_s?;
        let bonus = self.bonus(choice.behavior, input);
        Some(choice.reward * bonus.unwrap_or_else(|| libm::pow(DISCOUNT_PER_S, cost_s)))
    }

    /// Returns the utility of the behavior in progress per reward: 2 for a laden robot, and 1 for at most [`COMMIT`]
    /// without progress. Returns `None` for any other behavior.
    #[must_use]
    pub fn bonus(&self, behavior: BehaviorId, input: &Input<'_>) -> Option<f64> {
        let (active, since) = self.0?;
        if active != behavior {
            None
        } else if input.is_laden {
            Some(2.0)
        } else {
            (input.now.since(since) < COMMIT).then_some(1.0)
        }
    }
}

/// A bid for a task. The total order is the same in all algorithms: larger priority, larger utility, lower rank,
/// lower task. [`Ordering::Greater`] is the better bid. Bids of different robots or tasks are never equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bid {
    /// The priority of the task; a higher one goes first.
    pub priority: i32,
    /// The utility of the task for the robot.
    pub utility: f64,
    /// The robot that bids.
    pub robot: RobotId,
    /// The task that the robot bids for.
    pub task: TaskId,
}

impl Bid {
    /// Compares two bids; [`Ordering::Greater`] if this bid is better.
    #[must_use]
    pub fn order(&self, other: &Self) -> Ordering {
        self.priority
            .cmp(&other.priority)
            .then(self.utility.total_cmp(&other.utility))
            .then(other.robot.cmp(&self.robot))
            .then(other.task.cmp(&self.task))
    }
}

/// Returns the best applicable choice that `may` permits, by priority, utility and task, with its utility.
#[must_use]
pub fn best<'a>(
    under_way: &WorkInProgress,
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
        // Among equal bids of two behaviors for one task, the first stays.
        let is_better = best
            .as_ref()
            .is_none_or(|(_, other)| bid.order(other) == Ordering::Greater);
        if is_better && may(choice) {
            best = Some((choice, bid));
        }
    }
    best.map(|(choice, bid)| (choice, bid.utility))
}

impl WorkInProgress {
    /// Writes one row per applicable choice, with its utility and its state. `holder` returns the robot that holds a
    /// task.
    pub fn log(
        &self,
        me: &SelfState,
        input: &Input<'_>,
        decision: &mut Decision,
        holder: impl Fn(TaskId) -> Option<RobotId>,
    ) {
        let utility = |choice: &Choice| self.utility(choice, input).unwrap_or(0.0);
        log_choices(me, input, decision, utility, holder);
    }
}

/// Writes one row per applicable choice, like [`WorkInProgress::log`], with a utility of any kind.
pub(crate) fn log_choices(
    me: &SelfState,
    input: &Input<'_>,
    decision: &mut Decision,
    utility: impl Fn(&Choice) -> f64,
    holder: impl Fn(TaskId) -> Option<RobotId>,
) {
    for choice in input.choices.iter().filter(|choice| choice.applicable) {
        let is_active = decision.active == Some(choice.behavior);
        let (holder, state) = if is_active {
            (Some(me.robot), BehaviorState::Active)
        } else {
            (holder(choice.task), BehaviorState::Hibernating)
        };
        decision.rows.push(AllocationRow {
            task: choice.task,
            behavior: choice.behavior,
            utility: utility(choice),
            holder,
            state,
        });
    }
}
