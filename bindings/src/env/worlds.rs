//! A batch of environments, as Python has it: what is seen and done lies in arrays that Python copies to and from.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use alliance_proto::tick::Outcome;
use launch::Registry;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

use super::puppet::{Hands, Puppets};
use super::world::{Common, DRIVE, Level, World};
use crate::asked::Asked;
use crate::errors::mistake;

/// A batch of environments of one scenario.
#[pyclass(frozen, module = "alliance_agent")]
pub struct Worlds {
    common: Common,
    threads: usize,
    batch: Mutex<Batch>,
}

/// Environments and what is seen of them: by environment, and by agent but for what concerns the team.
struct Batch {
    places: Vec<Place>,
    observation: Vec<f32>,
    mask: Vec<i8>,
    alive: Vec<i8>,
    reward: Vec<f32>,
    /// 0: it goes on; 1: all is done, or nobody is left; 2: time is up.
    done: Vec<i8>,
}

/// An environment and the seed of its episode.
struct Place {
    world: World,
    seed: u64,
}

/// Some of a batch, for one thread.
struct Share<'a> {
    /// Number of the first one.
    first: usize,
    places: &'a mut [Place],
    observation: &'a mut [f32],
    mask: &'a mut [i8],
    alive: &'a mut [i8],
    reward: &'a mut [f32],
    done: &'a mut [i8],
}

/// The actions of a step, by environment and agent.
enum Actions {
    Decide(Vec<i64>),
    Drive(Vec<f32>),
}

impl Batch {
    fn new(common: &Common, envs: usize) -> Self {
        let agents = envs * width(common);
        let place = |seed| Place {
            world: World::new(common),
            seed,
        };
        Self {
            places: (0..envs as u64).map(place).collect(),
            observation: vec![0.0; agents * common.features],
            mask: vec![0; agents * actions(common)],
            alive: vec![0; agents],
            reward: vec![0.0; envs],
            done: vec![0; envs],
        }
    }

    /// In shares of so many environments.
    fn shares(&mut self, common: &Common, size: usize) -> Vec<Share<'_>> {
        let agents = size * width(common);
        let places = self.places.chunks_mut(size);
        let observation = self
            .observation
            .chunks_mut((agents * common.features).max(1));
        let mask = self.mask.chunks_mut(agents * actions(common));
        let alive = self.alive.chunks_mut(agents);
        let team = self.reward.chunks_mut(size).zip(self.done.chunks_mut(size));
        let all = places.zip(mask.zip(alive)).zip(team).enumerate();
        let mut observation = observation.fuse();
        all.map(
            |(number, ((places, (mask, alive)), (reward, done)))| Share {
                first: number * size,
                places,
                observation: observation.next().unwrap_or_default(),
                mask,
                alive,
                reward,
                done,
            },
        )
        .collect()
    }
}

/// Places for agents in an environment: one at least, so that no array is empty.
fn width(common: &Common) -> usize {
    common.agents.len().max(1)
}

/// Actions of an agent at level decide.
fn actions(common: &Common) -> usize {
    common.sets + 1
}

impl Share<'_> {
    /// What is to be seen of an environment.
    fn look(&mut self, common: &Common, at: usize) {
        let (features, actions) = (common.features, actions(common));
        let world = &self.places[at].world;
        for (agent, robot) in common.agents.iter().enumerate() {
            let place = at * width(common) + agent;
            self.alive[place] = i8::from(world.is_alive(*robot));
            let numbers = &mut self.observation[place * features..][..features];
            world.observe(common, agent, numbers);
            world.mask(common, agent, &mut self.mask[place * actions..][..actions]);
        }
    }

    fn step(&mut self, common: &Common, stride: u64, actions: &Actions) -> PyResult<()> {
        for at in 0..self.places.len() {
            let number = self.first + at;
            let place = &mut self.places[at];
            place.act(common, number, actions)?;
            self.reward[at] = place.world.step(common)? as f32;
            self.done[at] = match place.world.outcome {
                None => 0,
                Some(Outcome::TimeLimit) => 2,
                Some(_) => 1,
            };
            // Without a stride an episode that has ended stays as it is, to be looked at.
            if self.done[at] != 0 && stride != 0 {
                place.world.finish()?;
                place.seed = place.seed.wrapping_add(stride);
                place.world.reset(common, place.seed)?;
            }
            self.look(common, at);
            self.places[at].world.finish()?;
        }
        Ok(())
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

impl Worlds {
    fn batch(&self) -> MutexGuard<'_, Batch> {
        self.batch.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn at<T>(&self, index: usize, look: impl FnOnce(&mut Place) -> T) -> PyResult<T> {
        let mut batch = self.batch();
        let place = batch.places.get_mut(index);
        let no = || PyIndexError::new_err(format!("there is no environment {index}"));
        Ok(look(place.ok_or_else(no)?))
    }

    /// As many as there are agents in all environments, each finite.
    fn read(&self, py: Python<'_>, actions: &Bound<'_, PyAny>) -> PyResult<Actions> {
        let agents = self.common.agents.len() * self.batch().places.len();
        let (read, found, wanted) = match self.common.level {
            Level::Decide => {
                let read = PyBuffer::<i64>::get(actions)?.to_vec(py)?;
                let found = read.len();
                (Actions::Decide(read), found, agents)
            }
            Level::Drive => {
                let read = PyBuffer::<f32>::get(actions)?.to_vec(py)?;
                if let Some(wrong) = read.iter().find(|it| !it.is_finite()) {
                    let why = format!("an action holds {wrong}, which is no number");
                    return Err(PyValueError::new_err(why));
                }
                let found = read.len();
                (Actions::Drive(read), found, agents * DRIVE)
            }
        };
        if found == wanted {
            Ok(read)
        } else {
            let why = format!("actions hold {found} numbers; there must be {wanted}");
            Err(PyValueError::new_err(why))
        }
    }
}

#[pymethods]
impl Worlds {
    #[new]
    fn new(
        asked: Asked,
        level: &str,
        period_s: f64,
        envs: usize,
        threads: usize,
    ) -> PyResult<Self> {
        let level = match level {
            "decide" => Level::Decide,
            "drive" => Level::Drive,
            other => {
                let told = format!("level: there is no '{other}'; use 'decide' or 'drive'");
                return Err(mistake(told));
            }
        };
        if envs == 0 || threads == 0 {
            return Err(mistake("envs and threads: each must be at least 1"));
        }
        let puppets = Puppets(Arc::new(Hands::new(0)));
        let ready = asked.ready(Registry::built_in().kind(Arc::new(puppets)))?;
        let common = Common::new(ready, level, period_s)?;
        Ok(Self {
            batch: Mutex::new(Batch::new(&common, envs)),
            threads: threads.min(envs),
            common,
        })
    }

    /// Begins an episode in each environment, with seeds from this one on.
    fn reset(&self, py: Python<'_>, seed: u64) -> PyResult<()> {
        let common = &self.common;
        py.detach(|| {
            let mut batch = self.batch();
            let envs = batch.places.len();
            for mut share in batch.shares(common, envs) {
                for at in 0..envs {
                    let place = &mut share.places[at];
                    place.seed = seed.wrapping_add(at as u64);
                    place.world.reset(common, place.seed)?;
                    (share.reward[at], share.done[at]) = (0.0, 0);
                    share.look(common, at);
                }
            }
            Ok(())
        })
    }

    /// One step of each environment. With `auto_reset` those whose episode ends begin another one, with a seed of its own.
    fn step(&self, py: Python<'_>, actions: &Bound<'_, PyAny>, auto_reset: bool) -> PyResult<()> {
        let actions = self.read(py, actions)?;
        let common = &self.common;
        py.detach(|| {
            let mut batch = self.batch();
            let envs = batch.places.len();
            let stride = if auto_reset { envs as u64 } else { 0 };
            let mut shares = batch.shares(common, envs.div_ceil(self.threads));
            let Some((own, others)) = shares.split_first_mut() else {
                return Ok(());
            };
            thread::scope(|scope| {
                let others: Vec<_> = others
                    .iter_mut()
                    .map(|share| scope.spawn(|| share.step(common, stride, &actions)))
                    .collect();
                let mut done = own.step(common, stride, &actions);
                for other in others {
                    let other = other.join();
                    done = done.and(other.unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
                }
                done
            })
        })
    }

    /// Copies what is seen into arrays.
    fn see(
        &self,
        py: Python<'_>,
        observation: PyBuffer<f32>,
        mask: PyBuffer<i8>,
        alive: PyBuffer<i8>,
        reward: PyBuffer<f32>,
        done: PyBuffer<i8>,
    ) -> PyResult<()> {
        let batch = self.batch();
        observation.copy_from_slice(py, &batch.observation)?;
        mask.copy_from_slice(py, &batch.mask)?;
        alive.copy_from_slice(py, &batch.alive)?;
        reward.copy_from_slice(py, &batch.reward)?;
        done.copy_from_slice(py, &batch.done)
    }

    /// The next episode of an environment is logged in that folder.
    fn record(&self, index: usize, folder: PathBuf) -> PyResult<()> {
        self.at(index, |place| place.world.record = Some(folder))
    }

    /// Ends the episodes that are under way, and their logs.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            let mut batch = self.batch();
            batch.places.iter_mut().try_for_each(|it| it.world.close())
        })
    }

    /// Hash and outcome of the episode that has ended.
    fn ended(&self, index: usize) -> PyResult<(Option<String>, Option<&'static str>)> {
        self.at(index, |place| {
            let outcome = place.world.outcome.map(Outcome::as_str);
            (place.world.hash.clone(), outcome)
        })
    }

    /// The values of mission.csv.
    fn row(&self, index: usize) -> PyResult<Vec<Option<f64>>> {
        self.at(index, |place| place.world.row().collect())
    }

    /// The faults that are in force, in words.
    fn faults(&self, index: usize) -> PyResult<Vec<String>> {
        self.at(index, |place| place.world.faults())
    }

    /// x, y and heading of each robot.
    fn poses(&self, index: usize) -> PyResult<Vec<[f32; 3]>> {
        self.at(index, |place| place.world.poses())
    }

    #[getter]
    fn columns(&self) -> Vec<&'static str> {
        let columns = self.common.setup.catalog.mission.terms().columns;
        columns.iter().map(|column| column.name).collect()
    }

    #[getter]
    fn agents(&self) -> Vec<&str> {
        let agents = self.common.agents.iter();
        agents
            .map(|agent| self.common.setup.roster.name(*agent))
            .collect()
    }

    /// The names of an agent's sets, in the order of its actions from 1 on.
    fn sets(&self, agent: usize) -> PyResult<Vec<String>> {
        let agents = &self.common.agents;
        let no = || PyIndexError::new_err(format!("there is no agent {agent}"));
        let sets = self.common.sets_of(*agents.get(agent).ok_or_else(no)?);
        let name = |set| self.common.setup.catalog.behavior_name(set).to_owned();
        Ok(sets.into_iter().map(name).collect())
    }

    /// What the numbers of an agent's observation mean.
    fn feature_names(&self, agent: usize) -> Vec<String> {
        self.common.names(agent)
    }

    /// Environments, agents of each (one at least), numbers of an observation, actions at level decide.
    #[getter]
    fn shape(&self) -> (usize, usize, usize, usize) {
        let envs = self.batch().places.len();
        let common = &self.common;
        (envs, width(common), common.features, actions(common))
    }

    /// run.json's part that says what is run.
    #[getter]
    fn setup(&self) -> PyResult<String> {
        serde_json::to_string(&self.common.setup).map_err(mistake)
    }
}
