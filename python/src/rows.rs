//! Rows of allocation.csv for controllers without a utility of their own.

use proto::telemetry::{AllocationRow, BehaviorState};
use robot_agent::allocator::{Decision, Input};
use scenario::ids::{BehaviorId, RobotId};

/// Writes a row for each of the robot's sets. The utility is the bid, or else 1 for the active set and 0 for the
/// others.
pub fn rows(
    me: RobotId,
    input: &Input<'_>,
    decision: &mut Decision,
    bid: impl Fn(BehaviorId) -> Option<f64>,
) {
    for choice in input.choices {
        let is_active = decision.active == Some(choice.behavior);
        decision.rows.push(AllocationRow {
            task: choice.task,
            behavior: choice.behavior,
            utility: bid(choice.behavior).unwrap_or(if is_active { 1.0 } else { 0.0 }),
            holder: is_active.then_some(me),
            state: if is_active {
                BehaviorState::Active
            } else {
                BehaviorState::Hibernating
            },
        });
    }
}
