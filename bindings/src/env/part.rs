//! Some environments of a batch, and what is seen of them: those of one thread.

use alliance_proto::tick::Outcome;
use in_process::Spaces;
use pyo3::prelude::*;

use super::world::{Common, DRIVE, World};

/// Environments of a batch, one after the other.
pub struct Part {
    /// Number of the first one.
    first: usize,
    pub places: Vec<Place>,
    pub seen: Seen,
    /// They are stepped in turns.
    spaces: Spaces,
}

/// What is seen of environments: by environment, and by agent but for what concerns the team.
pub struct Seen {
    pub observation: Vec<f32>,
    pub mask: Vec<i8>,
    pub alive: Vec<i8>,
    pub reward: Vec<f32>,
    /// 0: it goes on; 1: all is done, or nobody is left; 2: time is up.
    pub done: Vec<i8>,
}

/// An environment and the seed of its episode.
pub struct Place {
    pub world: World,
    seed: u64,
}

/// The actions of a step, by environment and agent.
pub enum Actions {
    Decide(Vec<i64>),
    Drive(Vec<f32>),
}

/// Places for agents in an environment: one at least, so that no array is empty.
pub fn width(common: &Common) -> usize {
    common.agents.len().max(1)
}

/// Actions of an agent at level decide.
pub fn actions(common: &Common) -> usize {
    common.sets + 1
}

impl Part {
    /// So many environments, the numbers of which begin with that one.
    pub fn new(common: &Common, first: usize, envs: usize) -> Self {
        let agents = envs * width(common);
        let place = |_| Place {
            world: World::new(common),
            seed: 0,
        };
        Self {
            first,
            places: (0..envs).map(place).collect(),
            seen: Seen {
                observation: vec![0.0; agents * common.features],
                mask: vec![0; agents * actions(common)],
                alive: vec![0; agents],
                reward: vec![0.0; envs],
                done: vec![0; envs],
            },
            spaces: Spaces::default(),
        }
    }

    /// Begins an episode in each, with seeds from this one on, which is that of the batch's first environment.
    pub fn reset(&mut self, common: &Common, seed: u64) -> PyResult<()> {
        for at in 0..self.places.len() {
            let place = &mut self.places[at];
            place.seed = seed.wrapping_add((self.first + at) as u64);
            place.world.events.clear();
            place.world.reset(common, place.seed, &mut self.spaces)?;
            (self.seen.reward[at], self.seen.done[at]) = (0.0, 0);
            self.look(common, at);
        }
        Ok(())
    }

    /// One step of each. With a stride one whose episode ends begins another one, whose seed is so much larger.
    pub fn step(&mut self, common: &Common, stride: u64, actions: &Actions) -> PyResult<()> {
        for at in 0..self.places.len() {
            let number = self.first + at;
            let place = &mut self.places[at];
            place.act(common, number, actions)?;
            self.seen.reward[at] = place.world.step(common, &mut self.spaces)? as f32;
            self.seen.done[at] = match place.world.outcome {
                None => 0,
                Some(Outcome::TimeLimit) => 2,
                Some(_) => 1,
            };
            // Without a stride an episode that has ended stays as it is, to be looked at.
            if self.seen.done[at] != 0 && stride != 0 {
                place.world.finish()?;
                place.seed = place.seed.wrapping_add(stride);
                place.world.reset(common, place.seed, &mut self.spaces)?;
            }
            self.look(common, at);
            self.places[at].world.finish()?;
        }
        Ok(())
    }

    /// What is to be seen of an environment.
    fn look(&mut self, common: &Common, at: usize) {
        let (features, actions) = (common.features, actions(common));
        let (world, seen) = (&self.places[at].world, &mut self.seen);
        for (agent, robot) in common.agents.iter().enumerate() {
            let place = at * width(common) + agent;
            seen.alive[place] = i8::from(world.is_alive(*robot));
            let numbers = &mut seen.observation[place * features..][..features];
            world.observe(common, agent, numbers);
            world.mask(common, agent, &mut seen.mask[place * actions..][..actions]);
        }
    }

    /// Ends the episodes that are under way, and their logs.
    pub fn close(&mut self) -> PyResult<()> {
        self.places.iter_mut().try_for_each(|it| it.world.close())
    }
}

impl Place {
    fn act(&mut self, common: &Common, number: usize, actions: &Actions) -> PyResult<()> {
        let agents = common.agents.len();
        for (agent, robot) in common.agents.iter().enumerate() {
            let place = number * agents + agent;
            match actions {
                Actions::Decide(all) => self.world.decide(common, agent, all[place])?,
                Actions::Drive(all) => {
                    let mut action = [0.0; DRIVE];
                    action.copy_from_slice(&all[place * DRIVE..][..DRIVE]);
                    self.world.drive(common, *robot, action);
                }
            }
        }
        Ok(())
    }
}
