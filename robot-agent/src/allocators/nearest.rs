//! The `nearest` allocator: the applicable task of highest utility, independent of claims. Mission knowledge still
//! arrives in heartbeats; `nearest-silent` switches the radio off.

use scenario::ids::TaskId;

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
        self.under_way.record_progress(&self.me, input);
        let chosen = best(&self.under_way, self.me.robot, input, |choice| {
            choice.task != TaskId(0) || !is_broken("nearest-leaves-out-the-first-task")
        });
        decision.active = chosen.map(|(choice, _)| choice.behavior);
        self.under_way.log(&self.me, input, decision, |_| None);
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
