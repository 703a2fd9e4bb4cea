//! An engine whose values another rule learns while it runs: what L-ALLIANCE puts in the place of a scenario's parameters.

use std::sync::Arc;

use alliance_proto::scenario::Switches;

use super::engine::Engine;
use super::params::Config;
use super::values::{Learned, Values};
use crate::allocator::Me;

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
