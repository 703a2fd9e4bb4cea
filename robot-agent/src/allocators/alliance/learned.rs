//! An engine whose values another rule learns while it runs: what L-ALLIANCE puts in the place of a scenario's parameters.

use std::sync::Arc;

use alliance_proto::ids::RobotId;
use alliance_proto::scenario::Switches;
use alliance_proto::time::SimTime;

use super::engine::Engine;
use super::params::{Config, Toward};
use crate::allocator::Me;

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

impl Engine {
    /// A robot whose values will be learned: each set needs its [`Engine::learn`] before the first step.
    pub fn to_be_learned(me: &Me, threshold: f64, switches: Switches) -> Self {
        let mut engine = Self::of(Config::to_be_learned(me, threshold, switches));
        engine.learned = vec![Learned::default(); engine.behaviors.len()];
        engine
    }

    /// Takes over the values of the set at that place. Asks for memory only if they are new: the sets of a clone share theirs.
    pub fn learn(&mut self, place: usize, values: &Values<'_>) {
        let params = &mut self.config.sets[place].params;
        let toward_most = Some(values.toward_most);
        let is_known = params.fast == values.fast
            && params.toward_most == toward_most
            && params.toward == values.toward
            && (params.psi, params.lambda) == (values.psi, values.lambda);
        if !is_known {
            let params = Arc::make_mut(params);
            params.fast = values.fast;
            params.toward_most = toward_most;
            params.toward.clear();
            params.toward.extend_from_slice(values.toward);
            (params.psi, params.lambda) = (values.psi, values.lambda);
        }
        let is_same = std::mem::replace(&mut self.learned[place], values.learned) == values.learned;
        if !(is_known && is_same) {
            self.weigh_anew();
        }
    }

    /// What learning adds to the set at that place: nothing in ALLIANCE.
    pub(super) fn learned_of(&self, place: usize) -> Learned {
        self.learned.get(place).copied().unwrap_or_default()
    }
}
