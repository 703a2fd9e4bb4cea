//! A behavior set as its motivational behavior sees it: motivation and state.

use std::collections::BTreeSet;

use alliance_proto::ids::{BehaviorId, RobotId};
use alliance_proto::telemetry::{BehaviorState, Reason, StateChange};
use alliance_proto::time::SimTime;

/// State of a behavior set (thesis §3.3.1), with what each state has to remember.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Stance {
    /// Below θ, or not chosen.
    #[default]
    Hibernating,
    /// At θ, wishing for the task.
    Waiting {
        /// Since when.
        since: SimTime,
    },
    /// Executing.
    Active {
        /// Since when.
        since: SimTime,
        /// Whether it waited for the task in vain before (reason wait-bound).
        waited_out: bool,
    },
}

/// What a set has waited since it last hibernated, be it in one go or between claims that it had to give way to.
#[derive(Clone, Debug, Default)]
pub(super) struct Waited {
    /// How long, the wait that is going on not included.
    pub spent: SimTime,
    /// For whom: the teammates that executed the task meanwhile.
    pub on: BTreeSet<RobotId>,
}

impl Stance {
    /// The state as it is logged.
    pub fn state(self) -> BehaviorState {
        match self {
            Self::Hibernating => BehaviorState::Hibernating,
            Self::Waiting { .. } => BehaviorState::Waiting,
            Self::Active { .. } => BehaviorState::Active,
        }
    }
}

/// One of the robot's own behavior sets.
#[derive(Clone, Debug)]
pub(super) struct Behavior {
    /// Its id.
    pub set: BehaviorId,
    /// m, in [0, θ].
    pub motivation: f64,
    /// Since when m has been at θ.
    pub at_threshold_since: Option<SimTime>,
    /// Its state.
    pub stance: Stance,
    /// Its waits so far; `None` where it has not waited, as mostly: so the sets of a robot lie close together.
    pub waited: Option<Box<Waited>>,
}

impl Behavior {
    /// m(0) = 0.
    pub fn new(set: BehaviorId) -> Self {
        Self {
            set,
            motivation: 0.0,
            at_threshold_since: None,
            stance: Stance::Hibernating,
            waited: None,
        }
    }

    /// Takes over the motivation of this step.
    pub fn set_motivation(&mut self, motivation: f64, threshold: f64, now: SimTime) {
        self.motivation = motivation;
        if motivation < threshold {
            self.at_threshold_since = None;
        } else {
            self.at_threshold_since.get_or_insert(now);
        }
    }

    /// How long it has waited, the wait that is going on not included.
    pub fn spent_waiting(&self) -> SimTime {
        let waited = self.waited.as_ref();
        waited.map_or(SimTime::ZERO, |waited| waited.spent)
    }

    /// Changes the state and says so.
    pub fn enter(&mut self, stance: Stance, reason: Reason) -> StateChange {
        let from = self.stance.state();
        match (self.stance, stance) {
            (Stance::Waiting { since }, Stance::Active { since: now, .. }) => {
                let waited = self.waited.get_or_insert_default();
                waited.spent = waited.spent + now.since(since);
            }
            (_, Stance::Hibernating) => self.waited = None,
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

/// Those sets of a robot that do not hibernate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Awake {
    /// The active one, by its place.
    pub active: Option<usize>,
    /// How many wait.
    pub waiting: usize,
}

impl Awake {
    /// A set has changed its state.
    pub fn note(&mut self, place: usize, from: Stance, to: Stance) {
        match from {
            Stance::Hibernating => {}
            Stance::Waiting { .. } => self.waiting -= 1,
            Stance::Active { .. } => self.active = None,
        }
        match to {
            Stance::Hibernating => {}
            Stance::Waiting { .. } => self.waiting += 1,
            Stance::Active { .. } => self.active = Some(place),
        }
    }

    /// Whether all sets hibernate.
    pub fn is_none(&self) -> bool {
        self.active.is_none() && self.waiting == 0
    }
}
