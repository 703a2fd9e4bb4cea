//! The unit of work that a robot is at: when it has begun in earnest, and what makes the robot choose anew.
//!
//! A bid grows by the bonus of what is under way only once the work has begun in earnest: the robot is laden, or has achieved something,
//! or has been at it for τ. Sooner two robots that have not heard of each other would both claim the bonus for the same task, and their
//! ranks would decide between them instead of their bids.

use alliance_proto::ids::BehaviorId;
use alliance_proto::time::SimTime;
use smallvec::SmallVec;

use super::utility::{COMMIT, UnderWay};
use super::{Input, Me};

/// What a robot's bids depend on, but for where it is.
#[derive(Clone, Debug, Default, PartialEq)]
struct Situation {
    /// Of each choice: whether it is applicable and its cost known, and its round.
    choices: SmallVec<[(bool, SimTime); 6]>,
    is_laden: bool,
    has_begun: bool,
    has_lapsed: bool,
}

/// What a robot is at.
#[derive(Clone, Debug, Default)]
pub struct Unit {
    under_way: UnderWay,
    /// When it became active.
    activated: SimTime,
    /// As it was in the step before.
    before: Situation,
    now: Situation,
    /// Whether a unit was done in this step.
    is_done: bool,
}

impl Unit {
    /// At the beginning of a step. Whether the robot must choose anew.
    pub fn look(&mut self, me: &Me, input: &Input<'_>, active: Option<BehaviorId>) -> bool {
        self.under_way.note_progress(me, input);
        let mut own = me.behaviors.iter();
        let task = active
            .and_then(|active| own.find(|own| own.id == active))
            .map(|own| own.task);
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

    /// Whether the robot is in the midst of a unit, which it had better finish.
    pub fn goes_on(&self) -> bool {
        self.now.has_begun && !self.now.has_lapsed && !self.is_done
    }

    /// What is under way, if that has begun in earnest.
    pub fn begun(&self) -> UnderWay {
        if self.now.has_begun {
            self.under_way
        } else {
            UnderWay::default()
        }
    }

    /// What is under way.
    pub fn under_way(&self) -> &UnderWay {
        &self.under_way
    }

    /// At the end of a step, with what is active from now on.
    pub fn note_active(
        &mut self,
        before: Option<BehaviorId>,
        active: Option<BehaviorId>,
        now: SimTime,
    ) {
        if before != active {
            self.activated = now;
        }
        self.under_way.note_active(active, now);
    }
}
