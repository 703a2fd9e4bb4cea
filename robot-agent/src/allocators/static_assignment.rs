//! The `static` allocator: an assignment that never changes. A robot executes its assigned tasks by priority and
//! utility, and never those of a crashed teammate.

use crate::allocator::utility::{WorkInProgress, best};
use crate::allocator::{Allocator, Decision, Input, NoParameters, SelfState};

#[derive(Clone, Debug)]
pub struct Fixed {
    me: SelfState,
    under_way: WorkInProgress,
}

impl Allocator for Fixed {
    type Config = NoParameters;

    fn uses_assignment() -> bool {
        true
    }

    fn new(me: &SelfState, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            under_way: WorkInProgress::default(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.record_progress(&self.me, input);
        let is_assigned = |task| self.me.assigned.contains(&task);
        let chosen = best(&self.under_way, self.me.robot, input, |choice| {
            is_assigned(choice.task)
        });
        decision.active = chosen.map(|(choice, _)| choice.behavior);
        let holder = |task| is_assigned(task).then_some(self.me.robot);
        self.under_way.log(&self.me, input, decision, holder);
        self.under_way.record_active(decision.active, input.now);
    }
}
