//! Copies of environments in mid-episode.

use std::sync::{Arc, Mutex};

use pyo3::prelude::*;

use super::common::Common;
use super::part::{BatchPart, Slot, actions, width};

/// The states of some environments of a batch, in the order of their numbers.
#[pyclass(frozen, module = "alliance_sim")]
pub struct EnvironmentStates {
    /// The data of the batch, which its deep copies share.
    pub common: Arc<Common>,
    pub states: Mutex<Vec<EnvironmentState>>,
}

/// The state of an environment with its rows of the arrays.
pub struct EnvironmentState {
    slot: Slot,
    observation: Vec<f32>,
    mask: Vec<i8>,
    alive: Vec<i8>,
    reward: f32,
    done: i8,
}

impl BatchPart {
    /// Returns the state of the environment at this place of the part.
    pub fn state(&self, common: &Common, at: usize) -> PyResult<EnvironmentState> {
        let seen = &self.observations;
        let agents = width(common);
        let (features, actions) = (agents * common.features, agents * actions(common));
        Ok(EnvironmentState {
            slot: self.places[at].copied(common)?,
            observation: seen.observation[at * features..][..features].to_vec(),
            mask: seen.mask[at * actions..][..actions].to_vec(),
            alive: seen.alive[at * agents..][..agents].to_vec(),
            reward: seen.reward[at],
            done: seen.done[at],
        })
    }

    /// Continues the environment at this place from a copy of the state. Its current episode ends.
    pub fn restore(
        &mut self,
        common: &Common,
        at: usize,
        state: &EnvironmentState,
    ) -> PyResult<()> {
        let place = &mut self.places[at];
        let mut slot = state.slot.copied(common)?;
        place.world.close()?;
        slot.world.record = place.world.record.take();
        *place = slot;
        let seen = &mut self.observations;
        let agents = width(common);
        let (features, actions) = (agents * common.features, agents * actions(common));
        seen.observation[at * features..][..features].copy_from_slice(&state.observation);
        seen.mask[at * actions..][..actions].copy_from_slice(&state.mask);
        seen.alive[at * agents..][..agents].copy_from_slice(&state.alive);
        (seen.reward[at], seen.done[at]) = (state.reward, state.done);
        Ok(())
    }
}
