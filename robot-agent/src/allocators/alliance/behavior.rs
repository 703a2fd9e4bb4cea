//! The motivation and state of one behavior set.

use std::collections::BTreeSet;

use proto::telemetry::{BehaviorState, Reason, StateChange};
use scenario::ids::{BehaviorId, RobotId};
use scenario::time::SimTime;

/// The state of a behavior set (thesis §3.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum SetState {
    /// The motivation is below θ, or another set was chosen.
    #[default]
    Hibernating,
    /// The motivation is at θ; the set waits for an occupied task.
    Waiting { since: SimTime },
    Active {
        since: SimTime,
        /// True if the set activated because its waiting bound passed (reason wait-bound).
        waited_out: bool,
    },
}

/// The waits of a set since it last hibernated.
#[derive(Clone, Debug, Default)]
pub(super) struct Waited {
    /// The total waiting time without the current wait.
    pub total: SimTime,
    /// The teammates that executed the task during the waits.
    pub teammates: BTreeSet<RobotId>,
}

impl SetState {
    /// Returns the state as the log names it.
    pub fn state(self) -> BehaviorState {
        match self {
            Self::Hibernating => BehaviorState::Hibernating,
            Self::Waiting { .. } => BehaviorState::Waiting,
            Self::Active { .. } => BehaviorState::Active,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Behavior {
    pub set: BehaviorId,
    /// The motivation m, in [0, θ].
    pub motivation: f64,
    /// The time at which m reached θ.
    pub at_threshold_since: Option<SimTime>,
    pub stance: SetState,
    /// The waits so far, boxed to keep a robot's sets close together in memory.
    pub waited: Option<Box<Waited>>,
}

impl Behavior {
    pub fn new(set: BehaviorId) -> Self {
        Self {
            set,
            motivation: 0.0,
            at_threshold_since: None,
            stance: SetState::Hibernating,
            waited: None,
        }
    }

    /// Stores the motivation of this step and the time at which it reached θ.
    pub fn set_motivation(&mut self, motivation: f64, threshold: f64, now: SimTime) {
        self.motivation = motivation;
        if motivation < threshold {
            self.at_threshold_since = None;
        } else {
            self.at_threshold_since.get_or_insert(now);
        }
    }

    pub fn spent_waiting(&self) -> SimTime {
        let waited = self.waited.as_ref();
        waited.map_or(SimTime::ZERO, |waited| waited.total)
    }

    /// Changes the state and returns the change for the log.
    pub fn enter(&mut self, stance: SetState, reason: Reason) -> StateChange {
        let from = self.stance.state();
        match (self.stance, stance) {
            (SetState::Waiting { since }, SetState::Active { since: now, .. }) => {
                let waited = self.waited.get_or_insert_default();
                waited.total = waited.total + now.since(since);
            }
            (_, SetState::Hibernating) => self.waited = None,
            _ => {}
        }
        self.stance = stance;
        StateChange {
            set: self.set,
            from,
            to: stance.state(),
            reason,
        }
    }
}

/// The behavior sets of a robot that do not hibernate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NonHibernating {
    pub active: Option<usize>,
    pub waiting: usize,
}

impl NonHibernating {
    /// Updates the counts after a state change of the set at index `place`.
    pub fn note(&mut self, place: usize, from: SetState, to: SetState) {
        match from {
            SetState::Hibernating => {}
            SetState::Waiting { .. } => self.waiting -= 1,
            SetState::Active { .. } => self.active = None,
        }
        match to {
            SetState::Hibernating => {}
            SetState::Waiting { .. } => self.waiting += 1,
            SetState::Active { .. } => self.active = Some(place),
        }
    }

    /// Returns whether all sets hibernate.
    pub fn is_none(&self) -> bool {
        self.active.is_none() && self.waiting == 0
    }
}
