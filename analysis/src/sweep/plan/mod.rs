//! The plan file of a sweep.
//!
//! `file` defines its format. `factors` reads the varied keys, `several` missions with their faults, `hypothesis` claims, and
//! `tuning` the settings of a search, and `space` maps its coordinates to values.

mod factors;
pub(crate) mod file;
pub mod hypothesis;
mod leaves;
pub mod seeds;
mod several;
pub mod space;
#[cfg(test)]
mod tests;
pub mod tuning;

use std::path::{Path, PathBuf};

use anyhow::Context;
use missions::{Randomised, Registry};
use scenario::mission::registry::Mission;
use scenario::{KeyPath, Problem, Scenario, Setup, TomlFile, Vocabulary};
use xxhash_rust::xxh3::xxh3_64;

use super::design::{Design, FAULTS, apply_change};
use crate::random_mission::RandomMission;
use crate::shell::shell_quoted;
use factors::{
    CheckedSetting, disjoint, drawn, drawn_starts, faults, grid, list, presets, sample, seeds,
};
use file::{PlanFile, Source};
use hypothesis::Hypothesis;
use leaves::{leaves, path};
use several::missions;
use tuning::SearchSettings;
use world_server::faults::in_vain::in_vain;
use world_server::weights::include_weights;

/// The largest number of runs. Memory holds one row per run.
const MAX_RUNS: usize = 1_000_000;

#[derive(Clone, Debug)]
pub struct Plan {
    /// The base scenario with all defaults filled in; for several missions that of the first one.
    base: toml::Table,
    pub design: Design,
    /// The parts of the scenario that are drawn for each seed.
    mission: RandomMission,
    /// The starts and layouts that are drawn for each seed, after those parts.
    randomised: Randomised,
    /// True if the invariants of each run are checked.
    pub check: bool,
    /// True if each run records the measures of a comparison.
    pub measures: bool,
    /// The question that the plan states.
    pub question: Option<String>,
    /// The file of best known values for a comparison.
    pub best_known: Option<PathBuf>,
    pub hypotheses: Vec<Hypothesis>,
    /// The primary metrics that the plan states, by mission.
    pub metrics: Vec<StatedMetric>,
    /// The settings of `alliance tune`.
    pub tuning: Option<SearchSettings>,
    /// Values that contradict each other but are valid, such as faults after the end of a run, as lines.
    pub notes: Vec<String>,
}

/// A primary metric that a plan states for one of its missions.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedMetric {
    pub mission: String,
    pub metric: String,
    pub line: usize,
}

/// Refuses a file that states a scenario and nothing of a plan.
fn refuse_scenario(file: &TomlFile<'_>) -> anyhow::Result<()> {
    let missions = vocabulary().missions;
    let sections = missions.iter().map(Mission::name);
    let mut keys = sections.chain(["robots", "room", "body", "obstacles", "step_ms"]);
    let mut of_plan = ["scenario", "missions", "grid", "seeds"].into_iter();
    if of_plan.any(|key| file.has_key(key)) {
        return Ok(());
    }
    let Some(of_scenario) = keys.find(|of_scenario| file.has_key(of_scenario)) else {
        return Ok(());
    };
    let name = file.name();
    let remedy = format!(
        "run it with `alliance run {}`, or write a plan with scenario = \"{name}\"",
        shell_quoted(Path::new(name))
    );
    let what = "this is a scenario, not a plan";
    Err(file.error_at([of_scenario], what, remedy).into())
}

impl Plan {
    /// Reads a plan. `scenario` loads a scenario by name or file; `file_name` is for error messages. Each value is validated by
    /// itself, so a run can only fail on a combination of values.
    ///
    /// # Errors
    /// Returns the first mistake as one line: position, problem and remedy.
    pub fn parse(
        file_name: &str,
        text: &str,
        scenario: impl Fn(&str) -> anyhow::Result<Scenario>,
    ) -> anyhow::Result<Self> {
        let file = TomlFile::parse(file_name, text)?;
        refuse_scenario(&file)?;
        let contents: PlanFile = file.deserialize()?;
        let place = |at: &KeyPath| format!("{file_name}:{}", file.line_of(at));

        let mut stated = Vec::new();
        let mut columns = Vec::new();
        let mut factors = Vec::new();
        let metrics = metrics(&file, &contents);
        let bases = if contents.missions.is_empty() {
            let mut base = match contents.scenario {
                None => vocabulary().default_scenario()?,
                Some(Source::Named(name)) => {
                    scenario(&name).with_context(|| place(&KeyPath::new(["scenario"])))?
                }
                Some(Source::Inline) => file.scenario("scenario", &vocabulary())?,
            };
            if let Some(limit_s) = contents.limit_s {
                base.limit_s = limit_s;
            }
            let base = table_of(&base)?;
            let source = KeyPath::new(match contents.limit_s {
                Some(_) => ["limit_s"],
                None => ["scenario"],
            });
            Scenario::from_table(&base, &vocabulary()).with_context(|| place(&source))?;
            vec![base]
        } else {
            if contents.scenario.is_some() {
                let what = "a plan has either a scenario or [missions]";
                let remedy = "write it as the scenario of a mission";
                return Err(file.error_at(["scenario"], what, remedy).into());
            }
            let found = missions(
                &file,
                contents.missions,
                &contents.faults,
                contents.limit_s,
                &scenario,
                (&mut stated, &mut columns),
            )?;
            if found.factor.columns.len() > 1 {
                columns.push((KeyPath::new(["faults"]), path("faults")));
            }
            factors.push(found.factor);
            found.bases
        };
        let has_missions = !factors.is_empty();
        let of_missions = stated.len();

        for leaf in leaves(&file, &KeyPath::new(["grid"]), contents.grid, |_| false) {
            columns.push((leaf.at.clone(), leaf.path.clone()));
            factors.push(grid(&file, leaf, &mut stated)?);
        }
        factors.extend(list(&file, contents.list, &mut stated, &mut columns)?);
        if let Some(random) = contents.random {
            factors.extend(sample(&file, random, &mut stated, &mut columns)?);
        }
        if !contents.presets.is_empty() {
            columns.push((KeyPath::new(["presets"]), path("alliance.preset")));
            factors.push(presets(&file, &contents.presets)?);
        }
        if !has_missions && !contents.faults.is_empty() {
            columns.push((KeyPath::new(["faults"]), path("faults")));
            factors.push(faults(&file, contents.faults, &mut stated, &mut columns)?);
        }
        factors.push(seeds(&file, contents.seeds)?);
        let mission = contents.random_mission;
        columns.extend(drawn(&file, &mission)?);
        let names = contents.randomise.iter().map(String::as_str);
        let randomised = Randomised::from_names(names).map_err(|problem| file.locate(problem))?;
        if randomised.start && mission.robots.is_none() {
            columns.extend(drawn_starts(&bases));
        }
        disjoint(&file, &columns)?;
        let mut notes = Vec::new();
        let mut note = |at: String, scenario: &Scenario| {
            for problem in in_vain(scenario) {
                let text = format!("{at}: {problem}");
                if !notes.contains(&text) {
                    notes.push(text);
                }
            }
        };
        // Classes of faults replace those of the scenarios.
        if !columns.iter().any(|(_, of)| of[0] == FAULTS) {
            for base in &bases {
                note(
                    file_name.to_owned(),
                    &Scenario::from_table(base, &vocabulary())?,
                );
            }
        }
        for (number, CheckedSetting { at, changes }) in stated.iter().enumerate() {
            // Settings of a mission are validated on that mission, all others on every mission.
            let bases = if number < of_missions {
                &bases[..1]
            } else {
                &bases
            };
            for base in bases {
                let mut table = base.clone();
                for each in changes {
                    apply_change(&mut table, each).with_context(|| place(at))?;
                }
                let scenario =
                    Scenario::from_table(&table, &vocabulary()).with_context(|| place(at))?;
                note(place(at), &scenario);
            }
        }

        let design = Design { factors };
        if design.runs().is_none_or(|runs| runs > MAX_RUNS) {
            let sizes: Vec<String> = design
                .factors
                .iter()
                .map(|factor| factor.levels.len().to_string())
                .collect();
            let what = format!("{} runs are more than {MAX_RUNS}", sizes.join(" x "));
            let remedy = "take fewer values, or draw some under [random]";
            return Err(Problem::with_source(file_name, what, remedy).into());
        }
        let claims = contents.hypotheses.into_iter();
        let mut hypotheses: Vec<Hypothesis> = claims
            .map(|(name, claim)| Hypothesis {
                line: file.line_of(["hypotheses", &name]),
                name,
                claim,
            })
            .collect();
        hypotheses.sort_by_key(|hypothesis| hypothesis.line);
        let base = bases.into_iter().next().unwrap_or_default();
        Ok(Self {
            base,
            design,
            mission,
            randomised,
            check: contents.check,
            measures: false,
            question: contents.question,
            best_known: contents.best_known,
            hypotheses,
            metrics,
            tuning: contents.tune,
            notes,
        })
    }

    /// Returns a digest of everything that determines the runs, including the program version.
    #[must_use]
    pub fn digest(&self) -> String {
        let version = env!("CARGO_PKG_VERSION");
        let mut whole = format!("{version}\n{}\n{:?}", self.base, self.design);
        if self.measures {
            whole.push_str("\nmeasured");
        }
        if let Some(tuning) = &self.tuning {
            whole.push_str(&format!("\n{tuning:?}"));
        }
        for StatedMetric {
            mission, metric, ..
        } in &self.metrics
        {
            whole.push_str(&format!("\n{mission} by {metric}"));
        }
        // A hypothesis that changes after the first run would be worthless.
        for hypothesis in &self.hypotheses {
            whole.push_str(&format!("\n{}: {:?}", hypothesis.name, hypothesis.claim));
        }
        if self.check || self.mission != RandomMission::default() {
            whole.push_str(&format!("\n{:?}\n{}", self.mission, self.check));
        }
        if !self.randomised.is_empty() {
            whole.push_str(&format!("\n{:?}", self.randomised));
        }
        format!("{:016x}", xxh3_64(whole.as_bytes()))
    }

    /// Returns the base scenario as TOML; for several missions that of the first one.
    #[must_use]
    pub fn base(&self) -> String {
        self.base.to_string()
    }

    /// Returns the scenario of a run with all defaults filled in.
    ///
    /// # Errors
    /// Returns an error if the run's settings contradict each other.
    pub fn scenario(&self, run: usize) -> Result<toml::Table, String> {
        self.scenario_of_seed(run, self.design.seed(run))
    }

    /// Returns the scenario of a run as [`Plan::scenario`] does, with the draws of another seed.
    ///
    /// # Errors
    /// Returns an error if the run's settings contradict each other, or if no draw is valid.
    pub fn scenario_of_seed(&self, run: usize, seed: u64) -> Result<toml::Table, String> {
        let mut table = self.base.clone();
        for level in self.design.levels(run) {
            for each in &level.changes {
                apply_change(&mut table, each).map_err(|problem| problem.to_string())?;
            }
        }
        if self.mission == RandomMission::default() && self.randomised.is_empty() {
            return Ok(table);
        }
        let scenario =
            Scenario::from_table(&table, &vocabulary()).map_err(|error| error.to_string())?;
        let drawn = self.mission.draw(scenario, seed);
        let drawn = self.randomised.draw(&drawn, seed, Registry::current());
        let drawn = drawn.map_err(|problem| problem.to_string())?;
        // Converts through text, as for the base scenario.
        let text = drawn.to_toml().map_err(|error| error.to_string())?;
        toml::from_str(&text).map_err(|error| error.to_string())
    }
}

pub fn setup(scenario: &toml::Table, seed: u64) -> anyhow::Result<Setup> {
    let mut scenario = Scenario::from_table(scenario, &vocabulary())?;
    include_weights(&mut scenario)?;
    let worlds = Registry::current().worlds();
    worlds.find(&scenario)?.start_poses(&scenario)?;
    Ok(Setup::resolve(scenario, seed, None)?.setup)
}

fn metrics(file: &TomlFile<'_>, contents: &PlanFile) -> Vec<StatedMetric> {
    let missions = contents.missions.iter();
    let metrics = missions.filter_map(|(mission, contents)| {
        Some(StatedMetric {
            mission: mission.clone(),
            metric: contents.metric.clone()?,
            line: file.line_of(["missions", mission, "metric"]),
        })
    });
    metrics.collect()
}

/// Converts through text, so that a 32-bit float stays 0.2.
fn table_of(value: &impl serde::Serialize) -> anyhow::Result<toml::Table> {
    Ok(toml::from_str(&toml::to_string(value)?)?)
}

/// Returns the missions and allocators that scenarios may name.
fn vocabulary() -> Vocabulary {
    Registry::current().vocabulary()
}
