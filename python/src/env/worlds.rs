//! A batch of environments as a Python class. Python copies actions into its arrays and observations out of them.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread;
use std::time::Duration;

use launch::Registry;
use proto::event::EventLine;
use proto::tick::Outcome;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyBytes;
use run_log::recorder::Folder;

use super::common::{Common, DRIVE_ACTION_LEN, Level, StepLength};
use super::external_agent::{self, ExternalAgents};
use super::memory::check_memory;
use super::part::{Actions, BatchPart, Slot, actions, width};
use super::shaping::Shaping;
use super::snapshot::EnvironmentStates;
use super::threads::{Threads, Work};
use crate::errors::{alliance_error, scenario_error};
use crate::request::RunRequest;

/// A batch of environments of one scenario.
#[pyclass(frozen, module = "alliance_sim")]
pub struct EnvironmentBatch {
    common: Arc<Common>,
    envs: usize,
    /// The number of environments per part. There is one part per thread, and the last part can be smaller.
    size: usize,
    parts: Vec<Arc<Mutex<BatchPart>>>,
    threads: Mutex<Threads>,
}

/// The time, s, and the texts of an event.
type EventTuple = (f64, [String; 5]);

/// The end of an episode: environment, observation, hash, outcome, seed.
type EndTuple = (usize, Vec<f32>, Option<String>, &'static str, u64);

/// Locks a part. The GIL is released while the lock is not available.
fn locked<'p>(part: &'p Mutex<BatchPart>, py: Python<'_>) -> MutexGuard<'p, BatchPart> {
    let locked = part.lock_py_attached(py);
    locked.unwrap_or_else(PoisonError::into_inner)
}

/// Creates the parts of a batch without episodes, with at most `size` environments each.
fn empty_parts(common: &Common, envs: usize, size: usize) -> Vec<Arc<Mutex<BatchPart>>> {
    let part = |first| BatchPart::new(common, first, size.min(envs - first));
    let parts = (0..envs).step_by(size).map(part);
    parts.map(|part| Arc::new(Mutex::new(part))).collect()
}

impl EnvironmentBatch {
    /// Applies `look` to an environment. The GIL is released during the wait for its thread, which can need the GIL.
    fn at<T>(
        &self,
        py: Python<'_>,
        index: usize,
        look: impl FnOnce(&mut Slot) -> T,
    ) -> PyResult<T> {
        let no = || PyIndexError::new_err(format!("there is no environment {index}"));
        let part = self.parts.get(index / self.size).ok_or_else(no)?;
        let mut part = locked(part, py);
        let place = part.places.get_mut(index % self.size);
        Ok(look(place.ok_or_else(no)?))
    }

    /// Executes the work on each part of the batch, without the GIL.
    fn on_each(
        &self,
        py: Python<'_>,
        work: impl Fn(&Common, &mut BatchPart) -> PyResult<()> + Send + Sync + 'static,
    ) -> PyResult<()> {
        let common = Arc::clone(&self.common);
        let work: Work = Arc::new(move |part| work(&common, part));
        let interrupt = &self.common.interrupt;
        py.detach(|| {
            let mut threads = self.lock_threads()?;
            interrupt.clear();
            threads.on_each(&self.parts, &work, interrupt)
        })
    }

    /// Waits until no other thread uses the batch. Ctrl-C ends the wait.
    fn lock_threads(&self) -> PyResult<MutexGuard<'_, Threads>> {
        loop {
            match self.threads.try_lock() {
                Ok(threads) => return Ok(threads),
                Err(TryLockError::Poisoned(poisoned)) => return Ok(poisoned.into_inner()),
                Err(TryLockError::WouldBlock) => Python::attach(|py| py.check_signals())?,
            }
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// Reads the actions of all agents in all environments, and checks their numbers and ranges.
    fn read(&self, py: Python<'_>, actions: &Bound<'_, PyAny>) -> PyResult<Actions> {
        let agents = self.common.agents.len() * self.envs;
        let (read, found, wanted) = match self.common.level {
            Level::Decide => {
                let read = PyBuffer::<i64>::get(actions)?.to_vec(py)?;
                self.common.check_decisions(&read)?;
                let found = read.len();
                (Actions::Decide(read), found, agents)
            }
            Level::Drive => {
                let read = PyBuffer::<f32>::get(actions)?.to_vec(py)?;
                let wrong = read.iter().position(|value| !value.is_finite());
                let mut in_turn = self.common.agents.iter().cycle();
                if let Some(place) = wrong
                    && let Some(agent) = in_turn.nth(place / DRIVE_ACTION_LEN)
                {
                    let robot = self.common.setup.roster.name(*agent);
                    let why = format!(
                        "action of '{robot}': {} is not a finite number",
                        read[place]
                    );
                    return Err(PyValueError::new_err(why));
                }
                let found = read.len();
                (Actions::Drive(read), found, agents * DRIVE_ACTION_LEN)
            }
        };
        if found == wanted {
            Ok(read)
        } else {
            let why = format!("actions contain {found} values; they must contain {wanted}");
            Err(PyValueError::new_err(why))
        }
    }
}

#[pymethods]
impl EnvironmentBatch {
    #[new]
    fn new(
        asked: RunRequest,
        level: &str,
        length: (Option<f64>, Option<u64>),
        size: (usize, usize),
        shaping: Vec<(String, f64)>,
        extras: (bool, bool),
    ) -> PyResult<Self> {
        let (envs, threads) = size;
        let level = match level {
            "decide" => Level::Decide,
            "drive" => Level::Drive,
            other => {
                let text = format!("level: there is no '{other}'; use 'decide' or 'drive'");
                return Err(scenario_error(text));
            }
        };
        if envs == 0 || threads == 0 {
            return Err(scenario_error("envs and threads: each must be at least 1"));
        }
        let allocators = external_agent::kind(level, Arc::new(ExternalAgents::new(0)));
        let ready = asked.ready(Registry::built_in().with_allocator_kind(allocators))?;
        let (period_s, ticks) = length;
        let length = StepLength { period_s, ticks };
        let shaping = Shaping::from_weights(&shaping).map_err(scenario_error)?;
        let common = Common::new(ready, level, &length, shaping, extras)?;
        check_memory(&common, envs)?;
        let size = envs.div_ceil(threads);
        Ok(Self {
            envs,
            size,
            parts: empty_parts(&common, envs, size),
            threads: Mutex::default(),
            common: Arc::new(common),
        })
    }

    /// Starts an episode in each environment that has a seed. There is one entry per environment.
    fn reset(&self, py: Python<'_>, seeds: Vec<Option<u64>>) -> PyResult<()> {
        if seeds.len() != self.envs {
            let why = format!(
                "there are {} seeds for {} environments",
                seeds.len(),
                self.envs
            );
            return Err(PyValueError::new_err(why));
        }
        self.on_each(py, move |common, part| part.reset(common, &seeds))
    }

    /// Steps each environment once. With `auto_reset`, an environment whose episode ends starts another one with a new
    /// seed. Returns whether any episode is over.
    fn step(&self, py: Python<'_>, actions: &Bound<'_, PyAny>, auto_reset: bool) -> PyResult<bool> {
        let actions = self.read(py, actions)?;
        let stride = if auto_reset { self.envs as u64 } else { 0 };
        self.on_each(py, move |common, part| part.step(common, stride, &actions))?;
        let is_over = |part: &Arc<Mutex<BatchPart>>| {
            let part = locked(part, py);
            part.observations.done.iter().any(|done| *done != 0)
        };
        Ok(self.parts.iter().any(is_over))
    }

    /// Copies the observations of a part of the batch into arrays.
    #[expect(clippy::too_many_arguments)]
    fn see(
        &self,
        py: Python<'_>,
        part: usize,
        observation: PyBuffer<f32>,
        mask: PyBuffer<i8>,
        alive: PyBuffer<i8>,
        reward: PyBuffer<f32>,
        done: PyBuffer<i8>,
    ) -> PyResult<()> {
        let no = || PyIndexError::new_err(format!("there is no part {part}"));
        let part = locked(self.parts.get(part).ok_or_else(no)?, py);
        let seen = &part.observations;
        observation.copy_from_slice(py, &seen.observation)?;
        mask.copy_from_slice(py, &seen.mask)?;
        alive.copy_from_slice(py, &seen.alive)?;
        reward.copy_from_slice(py, &seen.reward)?;
        done.copy_from_slice(py, &seen.done)
    }

    /// Records the next episode of an environment in a folder, which must not contain a run.
    fn record(&self, py: Python<'_>, index: usize, folder: PathBuf) -> PyResult<()> {
        Folder::check_unused(&folder).map_err(alliance_error)?;
        self.at(py, index, |place| place.world.record = Some(folder))
    }

    /// Returns copies of the environments in the mask. There is one entry per environment.
    fn states(&self, py: Python<'_>, mask: Vec<bool>) -> PyResult<EnvironmentStates> {
        let mut states = Vec::new();
        for (part, mask) in self.parts.iter().zip(mask.chunks(self.size)) {
            let part = locked(part, py);
            for (at, _) in mask.iter().enumerate().filter(|(_, chosen)| **chosen) {
                states.push(part.state(&self.common, at)?);
            }
        }
        Ok(EnvironmentStates {
            common: Arc::clone(&self.common),
            states: Mutex::new(states),
        })
    }

    /// Continues the environments in the mask from copies of the states, in order. A single state is for all of them.
    fn restore(&self, py: Python<'_>, saved: &EnvironmentStates, mask: Vec<bool>) -> PyResult<()> {
        if !Arc::ptr_eq(&self.common, &saved.common) {
            let why =
                "the snapshot is from another environment; it fits this one and its deep copies";
            return Err(PyValueError::new_err(why));
        }
        let states = saved.states.lock_py_attached(py);
        let states = states.unwrap_or_else(PoisonError::into_inner);
        let chosen = mask.iter().filter(|chosen| **chosen).count();
        if states.len() != 1 && states.len() != chosen {
            let why = format!(
                "the snapshot has {} environments, and the mask {chosen}",
                states.len()
            );
            return Err(PyValueError::new_err(why));
        }
        let mut states = states.iter().cycle();
        for (part, mask) in self.parts.iter().zip(mask.chunks(self.size)) {
            let mut part = locked(part, py);
            part.ends.clear();
            for (at, _) in mask.iter().enumerate().filter(|(_, chosen)| **chosen) {
                if let Some(state) = states.next() {
                    part.restore(&self.common, at, state)?;
                }
            }
        }
        Ok(())
    }

    /// Returns a batch with the same states.
    fn copied(&self, py: Python<'_>) -> PyResult<Self> {
        let saved = self.states(py, vec![true; self.envs])?;
        let copy = Self {
            envs: self.envs,
            size: self.size,
            parts: empty_parts(&self.common, self.envs, self.size),
            threads: Mutex::default(),
            common: Arc::clone(&self.common),
        };
        copy.restore(py, &saved, vec![true; self.envs])?;
        Ok(copy)
    }

    /// Ends the current episodes and their logs.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.on_each(py, |_, part| part.close())
    }

    /// Returns the hash and outcome of the ended episode.
    fn ended(
        &self,
        py: Python<'_>,
        index: usize,
    ) -> PyResult<(Option<String>, Option<&'static str>)> {
        self.at(py, index, |place| {
            let outcome = place.world.outcome.map(Outcome::as_str);
            (place.world.hash.clone(), outcome)
        })
    }

    /// Returns the ends of episodes in the latest step whose environments have started other ones: number of the
    /// environment, last observation, hash, outcome, seed.
    fn ends(&self, py: Python<'_>) -> Vec<EndTuple> {
        let mut ends = Vec::new();
        for part in &self.parts {
            let part = locked(part, py);
            ends.extend(part.ends.iter().map(|end| {
                let outcome = end.outcome.as_str();
                (
                    end.number,
                    end.observation.clone(),
                    end.hash.clone(),
                    outcome,
                    end.seed,
                )
            }));
        }
        ends
    }

    /// Draws the room at this width, px. Returns height, width and the bytes of red, green and blue; `None` before the first
    /// episode.
    fn picture<'py>(
        &self,
        py: Python<'py>,
        index: usize,
        width_px: u32,
    ) -> PyResult<Option<(u32, u32, Bound<'py, PyBytes>)>> {
        let picture = self.at(py, index, |place| place.world.picture(width_px))??;
        Ok(picture.map(|pixels| (pixels.height, pixels.width, PyBytes::new(py, &pixels.rgb))))
    }

    fn row(&self, py: Python<'_>, index: usize) -> PyResult<Vec<Option<f64>>> {
        self.at(py, index, |place| place.world.row().collect())
    }

    /// Returns the events of the latest step: time, s, kind, robot, subject, reason, detail.
    fn events(&self, py: Python<'_>, index: usize) -> PyResult<Vec<EventTuple>> {
        let to_tuple = |event: &EventLine| {
            let texts = [
                &event.kind,
                &event.robot,
                &event.subject,
                &event.reason,
                &event.detail,
            ];
            (event.t_ms.as_secs_f64(), texts.map(String::clone))
        };
        self.at(py, index, |place| {
            place.world.events.iter().map(to_tuple).collect()
        })
    }

    fn faults(&self, py: Python<'_>, index: usize) -> PyResult<Vec<String>> {
        self.at(py, index, |place| place.world.faults())
    }

    /// Returns the pose of each robot: x, y, m, and heading, rad.
    fn poses(&self, py: Python<'_>, index: usize) -> PyResult<Vec<[f32; 3]>> {
        self.at(py, index, |place| place.world.poses())
    }

    #[getter]
    fn columns(&self) -> Vec<&'static str> {
        let columns = self.common.setup.catalog.mission.vocabulary().columns;
        columns.iter().map(|column| column.name).collect()
    }

    #[getter]
    fn agents(&self) -> Vec<&str> {
        let agents = self.common.agents.iter();
        agents
            .map(|agent| self.common.setup.roster.name(*agent))
            .collect()
    }

    /// Returns the names of an agent's sets, in the order of its actions from 1 on.
    fn sets(&self, agent: usize) -> PyResult<Vec<String>> {
        let agents = &self.common.agents;
        let no = || PyIndexError::new_err(format!("there is no agent {agent}"));
        let sets = self.common.sets_of(*agents.get(agent).ok_or_else(no)?);
        let name = |set| self.common.setup.catalog.behavior_name(set).to_owned();
        Ok(sets.into_iter().map(name).collect())
    }

    /// Returns the names of the values in an agent's observation.
    fn feature_names(&self, agent: usize) -> Vec<String> {
        self.common.names(agent)
    }

    /// Returns the numbers of environments, agents per environment (at least 1), values of an observation, and actions
    /// at level decide.
    #[getter]
    fn shape(&self) -> (usize, usize, usize, usize) {
        let common = &self.common;
        (self.envs, width(common), common.features, actions(common))
    }

    /// Returns the number of environments in a part of the batch. The last part can have fewer.
    #[getter]
    fn part_size(&self) -> usize {
        self.size
    }

    /// Returns the setup part of run.json.
    #[getter]
    fn setup(&self) -> PyResult<String> {
        serde_json::to_string(&self.common.setup).map_err(scenario_error)
    }
}
