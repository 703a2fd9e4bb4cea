//! `static`: an assignment made before the start and never changed. A robot carries out its own tasks, by priority and utility, and
//! touches no other, even if its owner has died.

use crate::allocator::utility::{UnderWay, best};
use crate::allocator::{Allocator, Decision, Input, Me, NoParameters};

/// One robot's part.
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
        let own = |task| self.me.assigned.contains(&task);
        let chosen = best(&self.under_way, self.me.robot, input, |choice| {
            own(choice.task)
        });
        decision.active = chosen.map(|(choice, _)| choice.behavior);
        let holder = |task| own(task).then_some(self.me.robot);
        self.under_way.log(&self.me, input, decision, holder);
        self.under_way.note_active(decision.active, input.now);
    }
}
