//! The suites: plans without allocators, frozen by the digest of their runs.

use anyhow::Context;
use scenario::limits::check_known;
use world_server::mission_args::{Known, read_scenario};
use xxhash_rust::xxh3::Xxh3;

use crate::compare::metrics::Metric;
use crate::compare::primary;
use crate::sweep::design::Cell;
use crate::sweep::plan::{Plan, setup};

/// A plan file of the program that varies missions, faults and seeds.
#[derive(Clone, Copy, Debug)]
pub struct Suite {
    pub name: &'static str,
    pub text: &'static str,
}

pub const SUITES: &[Suite] = &[Suite {
    name: "v1",
    text: include_str!("../../suites/v1.toml"),
}];

/// A suite with the allocators to measure.
pub struct SuitePlan {
    pub suite: Suite,
    pub allocators: Vec<String>,
    pub plan: Plan,
    /// The text of the plan file.
    pub text: String,
    /// The digest of the suite, 16 hexadecimal digits. It does not depend on the allocators.
    pub digest: String,
    /// The objectives of the missions, by condition: a mission under a class of faults.
    objectives: Vec<MissionObjective>,
}

/// The metric that ranks the runs of a mission.
#[derive(Clone, Debug, PartialEq)]
pub struct MissionObjective {
    pub metric: Metric,
    /// The time limit of a run, s.
    pub limit_s: f64,
}

/// The settings of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunSettings {
    pub mission: String,
    pub faults: String,
    pub allocator: String,
    pub seed: u64,
}

impl Suite {
    /// Returns the suite with this name.
    ///
    /// # Errors
    /// Returns an error that lists the known suites.
    pub fn find(name: &str) -> anyhow::Result<Self> {
        let names = SUITES.iter().map(|suite| suite.name);
        check_known((), "there is no suite", name, names)?;
        let found = SUITES.iter().find(|suite| suite.name == name);
        found.copied().context("there is no suite")
    }

    /// Makes the plan that runs these allocators.
    ///
    /// # Errors
    /// Returns an error for an unknown allocator, or a suite that this program's missions do not allow.
    pub fn plan(&self, allocators: &[String], known: &Known) -> anyhow::Result<SuitePlan> {
        let names = || known.vocabulary.allocators.iter();
        for allocator in allocators {
            let names = names().map(|allocator| allocator.name);
            check_known((), "there is no allocator", allocator, names)?;
        }
        let text = format!("{}\n[grid]\nallocator = {allocators:?}\n", self.text);
        let file = format!("suite {}", self.name);
        let plan = Plan::parse(&file, &text, |name| read_scenario(name, known))?;
        let mut all = SuitePlan {
            suite: *self,
            allocators: allocators.to_vec(),
            plan,
            text,
            digest: String::new(),
            objectives: Vec::new(),
        };
        let mut digest = Xxh3::new();
        for condition in 0..all.conditions() {
            let first = condition * all.runs_per_condition();
            let mut table = all.plan.scenario(first).map_err(anyhow::Error::msg)?;
            let setup = setup(&table, all.settings(first).seed)?;
            all.objectives.push(MissionObjective {
                metric: primary::of_scenario(&setup.scenario),
                limit_s: setup.scenario.limit_s,
            });
            table.remove("allocator");
            let RunSettings {
                mission, faults, ..
            } = all.settings(first);
            digest.update(format!("{mission}\n{faults}\n{table}\n").as_bytes());
        }
        for seed in 0..all.seeds() {
            digest.update(&all.plan.design.seed(seed).to_le_bytes());
        }
        all.digest = format!("{:016x}", digest.digest());
        Ok(all)
    }
}

impl SuitePlan {
    #[must_use]
    pub fn runs(&self) -> usize {
        self.plan.design.runs().unwrap_or_default()
    }

    fn seeds(&self) -> usize {
        self.plan.design.seeds_per_condition()
    }

    /// Returns the number of runs of a mission under a class of faults, over all allocators and seeds.
    fn runs_per_condition(&self) -> usize {
        self.runs() / self.conditions()
    }

    fn conditions(&self) -> usize {
        // A suite has [missions]: the first factor contains each mission with each class of faults.
        self.plan.design.factors[0].levels.len()
    }

    #[must_use]
    pub fn objective(&self, run: usize) -> &MissionObjective {
        &self.objectives[run / self.runs_per_condition()]
    }

    /// Returns the settings of a run: the columns of the design are mission, faults, allocator and seed.
    #[must_use]
    pub fn settings(&self, run: usize) -> RunSettings {
        let mut cells = self.plan.design.cells(run).map(Cell::to_string);
        let mut next = || cells.next().unwrap_or_default();
        RunSettings {
            mission: next(),
            faults: next(),
            allocator: next(),
            seed: self.plan.design.seed(run),
        }
    }
}
