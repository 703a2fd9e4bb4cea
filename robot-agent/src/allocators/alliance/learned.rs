//! Learned parameters of an engine: L-ALLIANCE replaces the scenario's values while the engine runs.

use std::sync::Arc;

use scenario::Switches;

use super::engine::Engine;
use super::params::Config;
use super::values::{LearnedTerms, LearnedValues};
use crate::allocator::SelfState;

impl Engine {
    /// Creates an engine whose parameters are learned. Each set needs one [`Engine::set_learned`] before the first step.
    pub fn to_be_learned(me: &SelfState, threshold: f64, switches: Switches) -> Self {
        let mut engine = Self::from_config(Config::to_be_learned(me, threshold, switches));
        engine.learned = vec![LearnedTerms::default(); engine.behaviors.len()];
        engine
    }

    /// Stores the learned parameters of the set at index `place`. Allocates only if they changed.
    pub fn set_learned(&mut self, place: usize, values: &LearnedValues<'_>) {
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

    /// Returns the terms that learning adds to the set at index `place`; the default in ALLIANCE.
    pub(super) fn learned_of(&self, place: usize) -> LearnedTerms {
        self.learned.get(place).copied().unwrap_or_default()
    }
}
