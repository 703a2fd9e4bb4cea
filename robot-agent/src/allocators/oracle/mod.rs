//! `oracle`: in each step the best assignment there is, from the truth. The world tells each robot what all of them have to offer that can
//! work, and each works out the same assignment from it: by the Hungarian method, of the largest sum of utilities. Only ever a
//! reference, for no team has this.

mod plan;
#[cfg(test)]
mod tests;

use alliance_proto::telemetry::Reason;

use crate::allocator::utility::UnderWay;
use crate::allocator::{Allocator, Decision, Input, Me, NoParameters};
use plan::Plan;

/// One robot's copy of the plan.
#[derive(Clone, Debug)]
pub struct Oracle {
    me: Me,
    under_way: UnderWay,
    plan: Plan,
}

impl Allocator for Oracle {
    type Config = NoParameters;

    fn wants_truth() -> bool {
        true
    }

    fn new(me: &Me, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            under_way: UnderWay::default(),
            plan: Plan::default(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.note_progress(&self.me, input);
        self.plan.make(input.truth, &self.me.briefs);
        let plan = || self.plan.taken(input.truth);
        let mine = plan().find(|it| it.robot == self.me.robot);
        // What could be done a step ago may not be applicable any more.
        decision.active = mine.map(|it| it.behavior).filter(|behavior| {
            let mut choices = input.choices.iter();
            choices.any(|it| it.behavior == *behavior && it.applicable)
        });
        decision.reason = Some(Reason::Awarded);
        let holder = |task| plan().find(|it| it.task == task).map(|it| it.robot);
        // What it offers now is weighed in the next step: with the bonus of what it has just taken up, else it would be taken from it.
        self.under_way.note_active(decision.active, input.now);
        self.under_way.log(&self.me, input, decision, holder);
    }
}
