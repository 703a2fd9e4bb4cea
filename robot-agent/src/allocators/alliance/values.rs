//! Values of behavior sets that are learned while a robot works, as L-ALLIANCE does.

use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;

use super::params::Toward;

/// Values of a behavior set from a step on.
#[derive(Clone, Copy, Debug)]
pub struct Values<'a> {
    /// δ_fast, motivation/s.
    pub fast: f64,
    /// δ_slow and φ toward most teammates.
    pub toward_most: Toward,
    /// Toward those for whom they are other ones, by rank.
    pub toward: &'a [(RobotId, Toward)],
    /// ψ.
    pub psi: SimTime,
    /// λ.
    pub lambda: SimTime,
    /// See [`Learned`].
    pub learned: Learned,
}

/// What learning adds to the equations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Learned {
    /// Whether the motivation of a set that hibernates stays 0: the factor learned_robot_influence.
    pub is_withheld: bool,
    /// From when on ψ and λ are counted, if that is after activation.
    pub trial: SimTime,
}
