//! The `oracle` allocator: in each step the assignment with the largest sum of utilities, from the ground truth. The
//! world sends each robot the offers of all working robots, and each computes the same assignment. No real team has
//! this information.

pub(in crate::allocators) mod plan;
#[cfg(test)]
mod tests;

use proto::telemetry::Reason;

use crate::allocator::utility::WorkInProgress;
use crate::allocator::{Allocator, Decision, Input, NoParameters, SelfState};
use plan::Plan;

#[derive(Clone, Debug)]
pub struct Oracle {
    me: SelfState,
    under_way: WorkInProgress,
    plan: Plan,
}

impl Allocator for Oracle {
    type Config = NoParameters;

    fn uses_ground_truth() -> bool {
        true
    }

    fn new(me: &SelfState, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            under_way: WorkInProgress::default(),
            plan: Plan::default(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.record_progress(&self.me, input);
        self.plan.compute(input.ground_truth, &self.me.briefs);
        let plan = || self.plan.assigned(input.ground_truth);
        let mine = plan().find(|offer| offer.robot == self.me.robot);
        // An offer of the previous step may not be applicable any more.
        decision.active = mine.map(|offer| offer.behavior).filter(|behavior| {
            let mut choices = input.choices.iter();
            choices.any(|choice| choice.behavior == *behavior && choice.applicable)
        });
        decision.reason = Some(Reason::Awarded);
        let holder = |task| {
            plan()
                .find(|offer| offer.task == task)
                .map(|offer| offer.robot)
        };
        // The next step weighs the offers logged now. They need the bonus of the new behavior, or the plan would take
        // it away again.
        self.under_way.record_active(decision.active, input.now);
        self.under_way.log(&self.me, input, decision, holder);
    }
}
