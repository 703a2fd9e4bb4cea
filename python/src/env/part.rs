//! The environments of one thread, with their observations.

use in_process::Workspaces;
use prefetch::Layer;
use proto::tick::Outcome;
use pyo3::prelude::*;

use super::common::{Common, DRIVE_ACTION_LEN};
use super::interrupt::Watch;
use super::world::Environment;

/// The duration of a reset in ticks.
const TICKS_PER_RESET: u32 = 64;

/// The number of environments of a thread whose memory stays in the second-level cache of a core. More of them gain from
/// requests of memory, fewer lose the time of the requests.
const CACHED_ENVIRONMENTS: usize = 48;

/// A contiguous range of a batch's environments.
pub struct BatchPart {
    /// The number of the first environment.
    first: usize,
    pub places: Vec<Slot>,
    pub observations: Observations,
    /// The ends of episodes in the latest step.
    pub ends: Vec<EpisodeEnd>,
    /// The memory that the environments share, because they are stepped in turn.
    spaces: Workspaces,
    watch: Watch,
}

/// The end of an episode whose environment has started another one in the same step.
pub struct EpisodeEnd {
    /// The number of the environment.
    pub number: usize,
    /// The last observation of the episode, by agent.
    pub observation: Vec<f32>,
    pub hash: Option<String>,
    pub outcome: Outcome,
    pub seed: u64,
}

/// The observations: arrays over environments and agents. Data about the team has one value per environment.
pub struct Observations {
    pub observation: Vec<f32>,
    pub mask: Vec<i8>,
    pub alive: Vec<i8>,
    pub reward: Vec<f32>,
    /// 0: in progress; 1: complete, or no robot left; 2: time limit.
    pub done: Vec<i8>,
}

/// An environment with the seed of its episode.
pub struct Slot {
    pub world: Environment,
    seed: u64,
}

/// The actions of a step, by environment and agent.
pub enum Actions {
    Decide(Vec<i64>),
    Drive(Vec<f32>),
}

/// Returns the number of agents per environment in the arrays: at least 1, so that no array is empty.
pub fn width(common: &Common) -> usize {
    common.agents.len().max(1)
}

/// Returns the number of actions of an agent at level decide.
pub fn actions(common: &Common) -> usize {
    common.sets + 1
}

impl BatchPart {
    /// Creates `envs` environments, numbered from `first` on.
    pub fn new(common: &Common, first: usize, envs: usize) -> Self {
        let agents = envs * width(common);
        let place = |_| Slot {
            world: Environment::new(common),
            seed: 0,
        };
        Self {
            first,
            places: (0..envs).map(place).collect(),
            observations: Observations {
                observation: vec![0.0; agents * common.features],
                mask: vec![0; agents * actions(common)],
                alive: vec![0; agents],
                reward: vec![0.0; envs],
                done: vec![0; envs],
            },
            ends: Vec::new(),
            spaces: Workspaces::default(),
            // The calling thread has the first part.
            watch: Watch::new(first > 0),
        }
    }

    /// Starts an episode in each environment that has a seed. `seeds` contains one entry per environment of the batch.
    pub fn reset(&mut self, common: &Common, seeds: &[Option<u64>]) -> PyResult<()> {
        self.ends.clear();
        for at in 0..self.places.len() {
            let Some(seed) = seeds[self.first + at] else {
                continue;
            };
            self.watch.count(TICKS_PER_RESET, &common.interrupt)?;
            let place = &mut self.places[at];
            place.seed = seed;
            place.world.events.clear();
            place.world.reset(common, place.seed, &mut self.spaces)?;
            (self.observations.reward[at], self.observations.done[at]) = (0.0, 0);
            self.observe(common, at);
        }
        Ok(())
    }

    /// Steps each environment once. With a nonzero stride, an environment whose episode ends starts another one, with
    /// the stride added to its seed.
    pub fn step(&mut self, common: &Common, stride: u64, actions: &Actions) -> PyResult<()> {
        self.ends.clear();
        for at in 0..self.places.len() {
            self.prefetch_after(at);
            let number = self.first + at;
            let place = &mut self.places[at];
            place.act(common, number, actions);
            self.observations.reward[at] =
                place
                    .world
                    .step(common, &mut self.spaces, &mut self.watch)? as f32;
            let outcome = place.world.outcome;
            self.observations.done[at] = match outcome {
                None => 0,
                Some(Outcome::TimeLimit) => 2,
                Some(_) => 1,
            };
            self.observe(common, at);
            let place = &mut self.places[at];
            place.world.finish(common)?;
            // Without a stride, an ended episode stays in its final state for inspection.
            if let Some(outcome) = outcome
                && stride != 0
            {
                let features = width(common) * common.features;
                self.ends.push(EpisodeEnd {
                    number,
                    observation: self.observations.observation[at * features..][..features]
                        .to_vec(),
                    hash: place.world.hash.clone(),
                    outcome,
                    seed: place.seed,
                });
                place.seed = place.seed.wrapping_add(stride);
                place.world.reset(common, place.seed, &mut self.spaces)?;
                self.observe(common, at);
            }
        }
        Ok(())
    }

    /// Requests the memory of the environments after this one, the outermost layer first.
    #[inline]
    fn prefetch_after(&self, at: usize) {
        if self.places.len() <= CACHED_ENVIRONMENTS {
            return;
        }
        let next = self.places[at..].iter().skip(1);
        for (place, layer) in next.zip(Layer::ALL.into_iter().rev()) {
            place.world.prefetch(layer);
        }
    }

    /// Writes the observations of an environment.
    fn observe(&mut self, common: &Common, at: usize) {
        let (agents, seen) = (width(common), &mut self.observations);
        let (features, actions) = (agents * common.features, agents * actions(common));
        self.places[at].world.observe(
            common,
            &mut seen.alive[at * agents..][..agents],
            &mut seen.observation[at * features..][..features],
            &mut seen.mask[at * actions..][..actions],
        );
    }

    /// Ends the current episodes and their logs.
    pub fn close(&mut self) -> PyResult<()> {
        self.places
            .iter_mut()
            .try_for_each(|place| place.world.close())
    }
}

impl Slot {
    /// Returns a copy with the same state, see [`Environment::copied`].
    pub fn copied(&self, common: &Common) -> PyResult<Self> {
        Ok(Self {
            world: self.world.copied(common)?,
            seed: self.seed,
        })
    }

    fn act(&mut self, common: &Common, number: usize, actions: &Actions) {
        let agents = common.agents.len();
        for (agent, robot) in common.agents.iter().enumerate() {
            let place = number * agents + agent;
            match actions {
                Actions::Decide(all) => self.world.decide(common, agent, all[place]),
                Actions::Drive(all) => {
                    let mut action = [0.0; DRIVE_ACTION_LEN];
                    action.copy_from_slice(&all[place * DRIVE_ACTION_LEN..][..DRIVE_ACTION_LEN]);
                    self.world.drive(common, *robot, action);
                }
            }
        }
    }
}
