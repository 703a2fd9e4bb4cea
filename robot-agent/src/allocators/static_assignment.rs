//! The `static` allocator: an assignment that never changes. A robot executes its assigned tasks by priority and
//! utility, and never those of a crashed teammate.

use std::sync::Arc;

use scenario::ids::{RobotId, TaskId};

use super::nearest::Nearest;
use crate::allocator::{Allocator, Decision, Input, NoParameters, SelfState};

#[derive(Clone, Debug)]
pub struct Fixed {
    me: RobotId,
    assigned: Arc<[TaskId]>,
    nearest: Nearest,
}

impl Allocator for Fixed {
    type Config = NoParameters;

    fn plans_sequences() -> bool {
        true
    }

    fn uses_assignment() -> bool {
        true
    }

    fn new(me: &SelfState, config: &NoParameters) -> Self {
        Self {
            me: me.robot,
            assigned: Arc::clone(&me.assigned),
            nearest: Nearest::new(me, config),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let is_assigned = |task| self.assigned.contains(&task);
        let holder = |task| is_assigned(task).then_some(self.me);
        self.nearest
            .step_among(input, decision, is_assigned, holder);
    }
}
