//! Command line of `alliance lalliance-strategies`.

use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread::available_parallelism;

use anyhow::Context;
use clap::Args;
use terminal::stderr_line;

use super::design::{RULES, conditions};
use super::figure::draw;
use super::results::{Study, trial_of_run};
use super::trial::{Trial, run_trial};
use crate::interrupted::InterruptFlag;
use crate::sweep::folder::write_atomically;
use crate::sweep::progress::Progress;
use crate::sweep::workers::run_parallel;

const TRIALS: &str = "trials.csv";
const TABLES: &str = "tables.md";
const FIGURE: &str = "strategies.svg";

/// Compare L-ALLIANCE's strategies I to IV with the optimum
///
/// The study uses one-shot tasks without travel whose times are known beforehand (docs/allocators/l-alliance.md).
#[derive(Args, Clone, Debug)]
pub struct StrategiesCommand {
    /// Instances of each size and spread
    #[arg(long, value_name = "N", default_value = "200", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: u32,
    /// Folder of the results
    #[arg(
        long,
        value_name = "DIR",
        default_value = "sweeps/lalliance-strategies"
    )]
    out: PathBuf,
    /// Number of concurrent runs [default: one per core]
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

impl StrategiesCommand {
    /// Runs the command. Exit status: 0 done, 1 interrupted, 3 a failed run or an unwritable file.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        match self.all() {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => {
                stderr_line!("interrupted: no results are written");
                ExitCode::from(1)
            }
            Err(error) => {
                stderr_line!("alliance lalliance-strategies: {error:#}");
                ExitCode::from(3)
            }
        }
    }

    /// Runs the study and writes its files. Returns `false` after an interruption.
    fn all(&self) -> anyhow::Result<bool> {
        let folder = &self.out;
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let Some(study) = self.study()? else {
            return Ok(false);
        };
        write_atomically(folder, TRIALS, &study.csv()?)?;
        write_atomically(folder, TABLES, study.markdown().as_bytes())?;
        write_atomically(folder, FIGURE, draw(&study)?.as_bytes())?;
        for (what, file) in [("trials", TRIALS), ("tables", TABLES), ("figure", FIGURE)] {
            stderr_line!("{what}   {}", folder.join(file).display());
        }
        Ok(true)
    }

    fn study(&self) -> anyhow::Result<Option<Study>> {
        let interrupted = InterruptFlag::install()?;
        let seeds = self.seeds as usize;
        let conditions = conditions();
        let runs: Vec<usize> = (0..Study::runs(seeds)).collect();
        let jobs = self.jobs.or_else(|| available_parallelism().ok());
        let jobs = jobs.unwrap_or(NonZeroUsize::MIN);
        let mut progress = Progress::new(0, runs.len());
        progress.print_line(&format!(
            "lalliance-strategies: {} runs; {jobs} at a time",
            runs.len()
        ));
        let mut done: BTreeMap<usize, Trial> = BTreeMap::new();
        let attempt = |run, _: &dyn Fn() -> bool| {
            let (condition, rule, seed) = trial_of_run(run, seeds);
            let (condition, rule) = (&conditions[condition], &RULES[rule]);
            let trial = run_trial(condition, rule, seed);
            Some((
                run,
                trial.with_context(|| format!("{condition}, {}, seed {seed}", rule.name)),
            ))
        };
        let worked = run_parallel(
            &runs,
            jobs,
            &|| interrupted.is_set(),
            attempt,
            |(run, trial)| {
                done.insert(run, trial?);
                progress.add(false);
                Ok(())
            },
        );
        progress.clear();
        worked?;
        let is_whole = done.len() == runs.len();
        Ok(is_whole.then(|| Study {
            conditions,
            seeds,
            trials: done.into_values().collect(),
        }))
    }
}
