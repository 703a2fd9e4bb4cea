//! The `nearest` allocator: the applicable task of highest utility, independent of claims. Mission knowledge still
//! arrives in heartbeats; `nearest-silent` switches the radio off.

use scenario::ids::{RobotId, TaskId};

use crate::allocator::utility::{WorkInProgress, best};
use crate::allocator::{Allocator, Decision, Input, NoParameters, SelfState};
use crate::broken::is_broken;

#[derive(Clone, Debug)]
pub struct Nearest {
    me: SelfState,
    under_way: WorkInProgress,
}

impl Allocator for Nearest {
    type Config = NoParameters;

    fn new(me: &SelfState, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            under_way: WorkInProgress::default(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.step_among(input, decision, |_| true, |_| None);
    }
}

impl Nearest {
    /// Selects the best task for which `may` is true. `holder` returns the robot that holds a task, for the log.
    pub(super) fn step_among(
        &mut self,
        input: &Input<'_>,
        decision: &mut Decision,
        may: impl Fn(TaskId) -> bool,
        holder: impl Fn(TaskId) -> Option<RobotId>,
    ) {
        self.under_way.record_progress(&self.me, input);
        let chosen = best(&self.under_way, self.me.robot, input, |choice| {
            let is_left_out = is_broken("nearest-leaves-out-the-first-task");
            may(choice.task) && !(is_left_out && choice.task == TaskId(0))
        });
        decision.active = chosen.map(|(choice, _)| choice.behavior);
        self.under_way.log(&self.me, input, decision, holder);
        self.under_way.record_active(decision.active, input.now);
    }
}

/// The `nearest` allocator without sending or receiving.
#[derive(Clone, Debug)]
pub struct NearestSilent(Nearest);

impl Allocator for NearestSilent {
    type Config = NoParameters;

    fn uses_radio() -> bool {
        false
    }

    fn new(me: &SelfState, config: &NoParameters) -> Self {
        Self(Nearest::new(me, config))
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.0.step(input, decision);
    }
}
