//! The study as a plan of `alliance sweep`: its runs and its files.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use anyhow::Context;
use terminal::stderr_line;

use super::design::Design;
use super::figure::draw;
use super::results::{Study, trial_of_run};
use super::trial::{Trial, run_trial};
use crate::interrupted::{InterruptFlag, Interrupted};
use crate::new_file::{make_folder, write_atomically};
use crate::progress::RunProgress;
use crate::workers::run_parallel;

const TRIALS: &str = "trials";
const TABLES: &str = "tables.md";
const FIGURE: &str = "strategies.svg";

/// A study that is ready to run.
pub struct StrategiesStudy {
    /// The name of the plan.
    pub name: String,
    pub design: Design,
    pub folder: PathBuf,
    pub jobs: NonZeroUsize,
}

impl StrategiesStudy {
    /// Runs the study and writes its files.
    ///
    /// # Errors
    /// Returns [`Interrupted`] after a signal, and the errors of runs and files.
    pub fn run(&self) -> anyhow::Result<()> {
        let folder: &Path = &self.folder;
        make_folder(folder)?;
        let Some(study) = self.trials()? else {
            stderr_line!("interrupted: no results are written");
            return Err(Interrupted.into());
        };
        study.table().write_csv(folder, TRIALS)?;
        write_atomically(&folder.join(TABLES), study.markdown().as_bytes())?;
        write_atomically(&folder.join(FIGURE), draw(&study)?.as_bytes())?;
        let trials = format!("{TRIALS}.csv");
        for (what, file) in [("trials", &*trials), ("tables", TABLES), ("figure", FIGURE)] {
            stderr_line!("{what}   {}", folder.join(file).display());
        }
        Ok(())
    }

    fn trials(&self) -> anyhow::Result<Option<Study>> {
        let interrupted = InterruptFlag::install()?;
        let design = &self.design;
        let runs: Vec<usize> = (0..design.runs()).collect();
        let mut progress = RunProgress::new(0, runs.len());
        progress.print_line(&format!(
            "sweep {}: {} runs; {} at a time",
            self.name,
            runs.len(),
            self.jobs
        ));
        let mut done: BTreeMap<usize, Trial> = BTreeMap::new();
        let attempt = |run, _: &dyn Fn() -> bool| {
            let (condition, rule, seed) = trial_of_run(run, design);
            let (condition, rule) = (&design.conditions[condition], &design.rules[rule]);
            let trial = run_trial(condition, rule, seed);
            let place = || format!("{condition}, {}, seed {seed}", rule.name);
            Some((run, trial.with_context(place)))
        };
        let stops = || interrupted.is_set();
        let worked = run_parallel(&runs, self.jobs, &stops, attempt, |(run, trial)| {
            done.insert(run, trial?);
            progress.add(false);
            Ok(())
        });
        progress.clear();
        worked?;
        let is_whole = done.len() == runs.len();
        Ok(is_whole.then(|| Study {
            design: design.clone(),
            trials: done.into_values().collect(),
        }))
    }
}
