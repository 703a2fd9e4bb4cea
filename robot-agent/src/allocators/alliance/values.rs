//! Parameters of behavior sets that L-ALLIANCE learns during a run.

use scenario::ids::RobotId;
use scenario::time::SimTime;

use super::params::TowardTeammate;

/// The learned parameters of a behavior set, valid from a step on.
#[derive(Clone, Copy, Debug)]
pub struct LearnedValues<'a> {
    /// δ_fast, in motivation/s.
    pub fast: f64,
    /// δ_slow and φ toward teammates not listed in `toward`.
    pub toward_most: TowardTeammate,
    /// δ_slow and φ that differ from `toward_most`, by rank.
    pub toward: &'a [(RobotId, TowardTeammate)],
    /// The time active before yielding (ψ).
    pub psi: SimTime,
    /// The time active before giving up (λ).
    pub lambda: SimTime,
    pub learned: LearnedTerms,
}

/// The terms that learning adds to the equations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LearnedTerms {
    /// True if the motivation of a hibernating set stays 0: the factor learned_robot_influence.
    pub is_withheld: bool,
    /// The start of the trial. ψ and λ count from here if it is later than the activation.
    pub trial: SimTime,
}
