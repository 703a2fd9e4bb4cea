//! The work around the step of an [`Allocator`]: state changes with their reasons, heartbeats, and the count of
//! progress.

use prefetch::prefetch;
use proto::team::TaskState;
use proto::telemetry::{BehaviorState, Reason, StateChange};
use scenario::Setup;
use scenario::ids::BehaviorId;
use scenario::time::SimTime;
use smallvec::{SmallVec, smallvec};

use super::{
    Allocator, Announcement, AnyConfig, Decision, Input, RunningAllocator, SelfState, StepOutcome,
};

/// An allocator with the heartbeats and state changes that all robots share.
#[derive(Clone, Debug)]
pub struct AllocatorRunner<A> {
    me: SelfState,
    allocator: A,
    decision: Decision,
    /// The time since which the active behavior is active, or the robot idle.
    since: SimTime,
    /// The time of the last heartbeat; `None` before the first step.
    sent: Option<SimTime>,
    /// The number of effects so far, per behavior, in the order of [`SelfState::behaviors`].
    progress: SmallVec<[u32; 6]>,
}

impl<A: Allocator> AllocatorRunner<A> {
    pub fn new(me: SelfState, config: &A::Config) -> Self {
        Self {
            allocator: A::new(&me, config),
            decision: Decision::default(),
            since: SimTime::ZERO,
            sent: None,
            progress: smallvec![0; me.behaviors.len()],
            me,
        }
    }

    #[cfg(test)]
    pub(crate) fn allocator(&self) -> &A {
        &self.allocator
    }

    fn announce(&self, state: TaskState, since: SimTime, behavior: BehaviorId) -> Announcement {
        let task = self.me.task_of(behavior);
        let own = self.me.behaviors.iter().zip(&self.progress);
        let mut done = own.filter(|(own, _)| Some(own.task) == task);
        Announcement {
            state,
            since,
            behavior: Some(behavior),
            task,
            progress: done.next().map_or(0, |(_, done)| *done),
        }
    }

    /// Adds the heartbeats of a step: at once after a change of state or progress, else every 1/ρ.
    fn add_heartbeats(
        &mut self,
        before: Option<BehaviorId>,
        input: &Input<'_>,
        outcome: &mut StepOutcome,
    ) {
        let now = input.now;
        let active = self.decision.active;
        let task_of = |behavior: Option<BehaviorId>| self.me.task_of(behavior?);
        let left = before.filter(|_| before != active);
        if let Some(left) = left.filter(|_| task_of(before) != task_of(active)) {
            outcome
                .announcements
                .push(self.announce(TaskState::Released, now, left));
        }
        let has_progressed = input
            .progressed
            .iter()
            .any(|task| Some(*task) == task_of(active));
        let is_due = self
            .sent
            .is_none_or(|sent| now.since(sent) >= self.me.heartbeat_period);
        if before == active && !has_progressed && !is_due {
            return;
        }
        self.sent = Some(now);
        outcome.announcements.push(match active {
            Some(active) => self.announce(TaskState::Executing, self.since, active),
            None => Announcement::idle(self.since),
        });
    }
}

impl<A: Allocator> RunningAllocator for AllocatorRunner<A> {
    fn checkpoint(&self) -> Box<dyn RunningAllocator> {
        Box::new(self.clone())
    }

    fn prefetch(&self) {
        prefetch(&*self.decision.rows);
        prefetch(&*self.progress);
    }

    fn weighs_costs(&self) -> bool {
        A::weighs_costs()
    }

    fn uses_radio(&self) -> bool {
        A::uses_radio()
    }

    fn adopt(&mut self, _: &Setup, config: Option<&AnyConfig>) -> bool {
        let config = config.and_then(|config| config.downcast_ref::<A::Config>());
        config.is_some_and(|config| self.allocator.adopt(config))
    }

    fn step(&mut self, input: &Input<'_>, outcome: &mut StepOutcome) {
        for task in input.progressed {
            // An effect counts for the task, with any of its behaviors.
            for (own, done) in self.me.behaviors.iter().zip(&mut self.progress) {
                *done += u32::from(own.task == *task);
            }
        }
        let before = self.decision.active;
        self.decision.reason = None;
        // Reuses the buffers of the previous agent in the workspace, which are still in the cache.
        std::mem::swap(&mut outcome.rows, &mut self.decision.rows);
        std::mem::swap(&mut outcome.say, &mut self.decision.say);
        self.decision.say.clear();
        self.decision.rows.clear();
        self.allocator.step(input, &mut self.decision);

        let mut choices = input.choices.iter();
        let is_applicable = |behavior: BehaviorId| {
            choices.any(|choice| choice.behavior == behavior && choice.applicable)
        };
        if let Some(chosen) = self.decision.active
            && !{ is_applicable }(chosen)
        {
            // The robot could not execute this choice. The agent ends, and its robot stops.
            panic!(
                "the allocator chose behavior {}, which is not applicable",
                chosen.0
            );
        }

        if let Some(row) = (self.decision.rows.iter()).find(|row| !row.utility.is_finite()) {
            panic!(
                "the allocator gives task {} the utility {}",
                row.task.0, row.utility
            );
        }

        let active = self.decision.active;
        outcome.changes.clear();
        outcome.announcements.clear();
        outcome.motivations.clear();
        if before != active {
            self.since = input.now;
            let cause = self.decision.reason;
            if let Some(left) = before {
                let mut choices = input.choices.iter();
                let can_go_on = choices.any(|choice| choice.behavior == left && choice.applicable);
                let cause = cause.unwrap_or(Reason::Reassigned);
                outcome.changes.push(StateChange {
                    set: left,
                    from: BehaviorState::Active,
                    to: BehaviorState::Hibernating,
                    reason: if can_go_on {
                        cause
                    } else {
                        Reason::NotApplicable
                    },
                });
            }
            if let Some(taken) = active {
                outcome.changes.push(StateChange {
                    set: taken,
                    from: BehaviorState::Hibernating,
                    to: BehaviorState::Active,
                    reason: cause.unwrap_or(Reason::Chosen),
                });
            }
        }
        if self.sent.is_none() {
            self.since = input.now;
        }
        self.add_heartbeats(before, input, outcome);
        outcome.active = active;
        std::mem::swap(&mut outcome.rows, &mut self.decision.rows);
        std::mem::swap(&mut outcome.say, &mut self.decision.say);
    }
}
