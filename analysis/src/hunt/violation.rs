//! The violations that a hunt searches for, and their names in plans.

use std::fmt;

use scenario::time::SimTime;
use serde::{Deserialize, Serialize};

use crate::invariants::Invariant;

/// A property of a run that a hunt searches for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ViolationKind {
    TicksGoOn,
    ItemsAccountedFor,
    NoOverlap,
    NumbersInRange,
    OneActiveBehavior,
    MissionHolds,
    ExclusiveTasks,
    Termination,
    ReplayIdentical,
    /// The mission is not complete at the end of the run.
    Incomplete,
    /// A robot can work and has an applicable task, but the remaining work does not decrease for a long time.
    Abandoned,
    /// Two robots that receive each other's messages execute the same exclusive task for a long time.
    Duplicated,
    /// A robot executes no task for a long time, and no robot executes one that is applicable to it.
    Idle,
    /// The run takes longer than a multiple of the run without faults.
    Slow,
    /// The program panicked, or the run did not reach its end for another reason. Every hunt searches for it.
    Panic,
    /// The PAR2 time reaches that of the worst run of a search.
    WorstPar2,
}

impl ViolationKind {
    /// The violations of invariants, in the order of their checks.
    pub const INVARIANTS: [Self; 9] = [
        Self::TicksGoOn,
        Self::ItemsAccountedFor,
        Self::NoOverlap,
        Self::NumbersInRange,
        Self::OneActiveBehavior,
        Self::MissionHolds,
        Self::ExclusiveTasks,
        Self::Termination,
        Self::ReplayIdentical,
    ];

    /// The violations that a plan can name besides the invariants.
    pub const OTHERS: [Self; 5] = [
        Self::Incomplete,
        Self::Abandoned,
        Self::Duplicated,
        Self::Idle,
        Self::Slow,
    ];

    /// Returns whether a condition that lasts too long is the violation, so that a run up to its time shows it.
    #[must_use]
    pub fn is_a_duration(self) -> bool {
        matches!(
            self,
            Self::Abandoned | Self::Duplicated | Self::Idle | Self::Slow
        )
    }

    /// Returns the name in plans and results.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::TicksGoOn => "ticks-go-on",
            Self::ItemsAccountedFor => "items-accounted-for",
            Self::NoOverlap => "no-overlap",
            Self::NumbersInRange => "numbers-in-range",
            Self::OneActiveBehavior => "one-active-set",
            Self::MissionHolds => "mission-holds",
            Self::ExclusiveTasks => "exclusive-tasks",
            Self::Termination => "termination",
            Self::ReplayIdentical => "replay-identical",
            Self::Incomplete => "incomplete",
            Self::Abandoned => "abandoned",
            Self::Duplicated => "duplicated",
            Self::Idle => "idle",
            Self::Slow => "slow",
            Self::Panic => "panic",
            Self::WorstPar2 => "worst-par2",
        }
    }
}

impl From<Invariant> for ViolationKind {
    fn from(invariant: Invariant) -> Self {
        match invariant {
            Invariant::TicksGoOn => Self::TicksGoOn,
            Invariant::ItemsAccountedFor => Self::ItemsAccountedFor,
            Invariant::NoOverlap => Self::NoOverlap,
            Invariant::NumbersInRange => Self::NumbersInRange,
            Invariant::OneActiveBehavior => Self::OneActiveBehavior,
            Invariant::MissionHolds => Self::MissionHolds,
            Invariant::ExclusiveTasks => Self::ExclusiveTasks,
            Invariant::Termination => Self::Termination,
            Invariant::ReplayIdentical => Self::ReplayIdentical,
        }
    }
}

impl fmt::Display for ViolationKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A violation in a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FoundViolation {
    pub kind: ViolationKind,
    /// The simulated time of the violation, ms.
    pub at_ms: SimTime,
    /// The violation in one line.
    pub description: String,
}
