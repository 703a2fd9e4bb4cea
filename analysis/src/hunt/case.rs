//! A case: a scenario, a seed and the faults of one run. Its judgement, and the interface through which searches and
//! the shrinker request judgements.

use std::sync::Arc;

use missions::Registry;
use scenario::fault::Order;
use scenario::time::SimTime;
use scenario::{Scenario, Setup};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::violation::{FoundViolation, ViolationKind};

/// The inputs of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The scenario without faults.
    pub scenario: Arc<Scenario>,
    pub seed: u64,
    pub faults: Vec<Order>,
    /// The makespan of the same run without faults; `None` if it is not known.
    pub base_ms: Option<SimTime>,
}

impl Case {
    /// Returns the same case without faults.
    #[must_use]
    pub fn without_faults(&self) -> Self {
        Self {
            faults: Vec::new(),
            ..self.clone()
        }
    }

    /// Returns the scenario with the faults.
    #[must_use]
    pub fn whole_scenario(&self) -> Scenario {
        let mut scenario = (*self.scenario).clone();
        scenario.faults.timeline.clone_from(&self.faults);
        scenario
    }

    /// Returns the scenario file of the case.
    ///
    /// # Errors
    /// Returns an error if the scenario cannot be written.
    pub fn to_toml(&self) -> anyhow::Result<String> {
        Ok(self.whole_scenario().to_toml()?)
    }

    /// Returns the checked inputs of the run.
    ///
    /// # Errors
    /// Returns an error if the scenario and the faults contradict each other.
    pub fn setup(&self) -> anyhow::Result<Setup> {
        let scenario = self.whole_scenario();
        let worlds = Registry::current().worlds();
        worlds.find(&scenario)?.start_poses(&scenario)?;
        Ok(Setup::resolve(scenario, self.seed, None)?.setup)
    }

    /// Returns a digest of everything that determines the run.
    #[must_use]
    pub fn digest(&self) -> u64 {
        xxh3_64(format!("{self:?}").as_bytes())
    }
}

/// The conditions that a run is judged by.
#[derive(Clone, Debug, PartialEq)]
pub struct Conditions {
    /// The violations to search for. [`ViolationKind::Panic`] always counts.
    pub violations: Vec<ViolationKind>,
    /// The time for which an applicable task may be left before it counts as abandoned.
    pub abandoned: SimTime,
    /// The time for which two robots may execute one exclusive task.
    pub duplicated: SimTime,
    /// The time for which a robot may be idle beside an applicable task without an executor.
    pub idle: SimTime,
    /// The multiple of the fault-free makespan from which a run is slow.
    pub slow_factor: f64,
    /// The PAR2 time from which a run counts as [`ViolationKind::WorstPar2`].
    pub par2_from: Option<SimTime>,
}

impl Conditions {
    /// Returns whether a violation of this kind is searched for.
    #[must_use]
    pub fn include(&self, kind: ViolationKind) -> bool {
        kind == ViolationKind::Panic || self.violations.contains(&kind)
    }

    /// Returns the same conditions for a single kind of violation.
    #[must_use]
    pub fn only(&self, kind: ViolationKind) -> Self {
        Self {
            violations: vec![kind],
            ..self.clone()
        }
    }

    /// Returns the simulated time from which a run is slow.
    #[must_use]
    pub fn slow_from(&self, base: SimTime) -> SimTime {
        SimTime::from_secs_f64(base.as_secs_f64() * self.slow_factor)
    }
}

/// The result of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// The violation that occurs first in the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub violation: Option<FoundViolation>,
    /// True if the mission is complete.
    pub complete: bool,
    /// The simulated time at the end of the run, or at the violation.
    pub end_ms: SimTime,
    /// The longest time without less remaining work while a robot could work.
    pub idle_ms: SimTime,
    /// The covered states, as hashes in ascending order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<u32>,
    /// The makespan of the run without faults, if it was needed and is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_ms: Option<SimTime>,
    /// The reason if the scenario and the faults contradict each other, so that there was no run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub invalid: Option<String>,
}

impl Judgement {
    /// Returns the PAR2 time: the makespan, or twice the limit of a run that is not complete.
    #[must_use]
    pub fn par2(&self, limit: SimTime) -> SimTime {
        if self.complete {
            self.end_ms
        } else {
            limit + limit
        }
    }

    /// Returns the kind of the violation, if there is one.
    #[must_use]
    pub fn kind(&self) -> Option<ViolationKind> {
        self.violation.as_ref().map(|found| found.kind)
    }
}

/// The executor of runs.
pub trait Judge {
    /// Runs the cases and returns their judgements in the same order.
    ///
    /// # Errors
    /// Returns an error after an interruption, or if a judgement cannot be stored.
    fn judge(&mut self, cases: &[Case], conditions: &Conditions) -> anyhow::Result<Vec<Judgement>>;

    /// Returns the wall-clock time of all judged batches, s. It is 0 if the budget is a number of runs.
    fn elapsed_s(&self) -> f64 {
        0.0
    }

    /// Shows a line of progress.
    fn note(&mut self, _line: &str) {}
}
