//! The `static` allocator: an assignment that never changes. A robot executes its assigned tasks by priority and
//! utility, and never those of a crashed teammate.

use crate::allocator::utility::{UnderWay, best};
use crate::allocator::{Allocator, Decision, Input, Me, NoParameters};

#[derive(Clone, Debug)]
pub struct Fixed {
    me: Me,
    under_way: UnderWay,
}

impl Allocator for Fixed {
    type Config = NoParameters;

    fn wants_assignment() -> bool {
        true
    }

    fn new(me: &Me, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            under_way: UnderWay::default(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.note_progress(&self.me, input);
        let is_assigned = |task| self.me.assigned.contains(&task);
        let chosen = best(&self.under_way, self.me.robot, input, |choice| {
            is_assigned(choice.task)
        });
        decision.active = chosen.map(|(choice, _)| choice.behavior);
        let holder = |task| is_assigned(task).then_some(self.me.robot);
        self.under_way.log(&self.me, input, decision, holder);
        self.under_way.note_active(decision.active, input.now);
    }
}
