//! The unit of work in progress, and the events that make the robot select again.
//!
//! A bid gets the bonus of work in progress only once the unit has begun: the robot is laden, has had an effect, or
//! has been active for τ. With an earlier bonus, two robots could both claim it for one task before they receive each
//! other's bids. Their ranks would then decide instead of their bids.

use scenario::ids::BehaviorId;
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::utility::{COMMIT, WorkInProgress};
use super::{Input, SelfState};

/// The state that a robot's bids depend on, except its position.
#[derive(Clone, Debug, Default, PartialEq)]
struct Situation {
    /// Per choice: whether it is applicable with a known cost, and its round.
    choices: SmallVec<[(bool, SimTime); 6]>,
    is_laden: bool,
    has_begun: bool,
    has_lapsed: bool,
}

/// The unit of work of one robot, and the state in which it last selected.
#[derive(Clone, Debug, Default)]
pub struct WorkUnit {
    under_way: WorkInProgress,
    /// The time at which the active behavior became active.
    activated: SimTime,
    before: Situation,
    now: Situation,
    /// True if a unit ended in this step.
    is_done: bool,
}

impl WorkUnit {
    /// Updates the state at the start of a step. Returns whether the robot must select again.
    pub fn update(
        &mut self,
        me: &SelfState,
        input: &Input<'_>,
        active: Option<BehaviorId>,
    ) -> bool {
        self.under_way.record_progress(me, input);
        let task = active.and_then(|active| me.task_of(active));
        self.is_done = task.is_some_and(|task| input.progressed.contains(&task));
        let age = |since| input.now.since(since);
        std::mem::swap(&mut self.before, &mut self.now);
        let choices = input.choices.iter();
        self.now.choices.clear();
        self.now.choices.extend(choices.map(|choice| {
            let is_possible = choice.applicable && choice.cost_s.is_some();
            (is_possible, choice.round)
        }));
        let since = self.under_way.since();
        self.now.is_laden = input.is_laden;
        self.now.has_begun = since.is_some_and(|since| {
            input.is_laden || since > self.activated || age(self.activated) >= me.ceased_after
        });
        self.now.has_lapsed = since.is_some_and(|since| !input.is_laden && age(since) >= COMMIT);
        self.is_done || self.now != self.before
    }

    /// Returns whether the robot should finish its current unit before it selects again.
    pub fn should_continue(&self) -> bool {
        self.now.has_begun && !self.now.has_lapsed && !self.is_done
    }

    /// Returns the unit in progress, if it has begun; else an empty value.
    pub fn committed(&self) -> WorkInProgress {
        if self.now.has_begun {
            self.under_way
        } else {
            WorkInProgress::default()
        }
    }

    /// Returns the behavior in progress, also before its unit has begun.
    pub fn under_way(&self) -> &WorkInProgress {
        &self.under_way
    }

    /// Updates the state at the end of a step, with the active behavior of the next one.
    pub fn note_active(
        &mut self,
        before: Option<BehaviorId>,
        active: Option<BehaviorId>,
        now: SimTime,
    ) {
        if before != active {
            self.activated = now;
        }
        self.under_way.record_active(active, now);
    }
}
