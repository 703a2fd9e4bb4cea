//! Command line, output files and terminal output of `alliance hunt`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::slice;

use clap::Args;
use indicatif::HumanDuration;
use terminal::{counted, stderr_line};
use tokio::time::Instant;
use world_server::mission_args::{Known, read_scenario};

use super::case::Judgement;
use super::hunting::{AllocatorResult, hunt};
use super::judge::judge;
use super::page;
use super::plan::{Budget, HuntPlan, Method};
use super::record::{Executor, JOURNAL};
use super::results::{command, least_path, sentence, shown, table, write};
use super::search::{BATCH, Search, SeverityMeasure};
use crate::batch_journal::{BatchJournal, Header};
use crate::exit_status;
use crate::interrupted::{InterruptFlag, Interrupted};
use crate::new_file::{make_folder, write_atomically};
use crate::progress::RunProgress;
use crate::sweep::execution::{PLAN, command_words, jobs, jobs_or_cores, plan_name, read_text};
use crate::table::bullets;
use crate::workers::run_parallel;

const PAGE: &str = "hunt.html";

/// The assumed number of runs per second and job, if the budget is a time. It only affects the progress display.
const RUNS_PER_S: f64 = 5.0;

/// Search for faults that break an allocator, and shrink them
// An interrupted hunt resumes where it stopped.
#[derive(Args, Clone, Debug)]
pub struct HuntCommand {
    /// Plan of the hunt in TOML
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// Folder of the results [default: hunts/PLAN without .toml]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of concurrent runs [default: one per core]
    #[arg(long, value_name = "N", value_parser = jobs)]
    jobs: Option<NonZeroUsize>,
    /// Print the number of runs, their time and the searched faults
    #[arg(long, conflicts_with = "out")]
    dry_run: bool,
}

impl HuntCommand {
    /// Runs the command. Exit status: 0 no violation, 1 a violation, 2 invalid input, 3 a file cannot be written, 130 an
    /// interruption.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        // All inputs are read and checked before the first run.
        let (plan, text) = match self.read(known) {
            Ok(read) => read,
            Err(error) => return exit_status("hunt", Err(error), 2),
        };
        if self.dry_run {
            let estimated = self.estimate(&plan);
            return exit_status("hunt", estimated.map(|()| ExitCode::SUCCESS), 3);
        }
        let (record, folder) = match self.prepare(&plan, &text) {
            Ok(prepared) => prepared,
            Err(error) => return exit_status("hunt", Err(error), 2),
        };
        let done = self.work(&plan, record, &folder);
        if done.as_ref().is_err_and(|error| error.is::<Interrupted>()) {
            let paths = slice::from_ref(&self.plan);
            let again = command_words("hunt", paths, self.out.as_deref(), self.jobs);
            stderr_line!("interrupted; continue with\n  {again}");
        }
        exit_status("hunt", done.map(|found| ExitCode::from(u8::from(found))), 3)
    }

    fn read(&self, known: &Known) -> anyhow::Result<(HuntPlan, String)> {
        let text = read_text(&self.plan)?;
        let folder = self.plan.parent().unwrap_or(Path::new(""));
        let plan = HuntPlan::parse(&self.plan.display().to_string(), &text, |name| {
            // Files are relative to the plan, not to the working directory.
            let source = match known.vocabulary.builtin(name) {
                Some(_) => name.to_owned(),
                None => folder.join(name).display().to_string(),
            };
            read_scenario(&source, known)
        })?;
        Ok((plan, text))
    }

    fn prepare(
        &self,
        plan: &HuntPlan,
        text: &str,
    ) -> anyhow::Result<(BatchJournal<Judgement>, PathBuf)> {
        let name = plan_name(&self.plan);
        let default = || Path::new("hunts").join(&name);
        let folder = self.out.clone().unwrap_or_else(default);
        let header = Header::new("hunt", &name, plan.digest());
        make_folder(&folder)?;
        let record = BatchJournal::open(folder.join(JOURNAL), &header)?;
        write_atomically(&folder.join(PLAN), text.as_bytes())?;
        Ok((record, folder))
    }

    /// Executes the hunt and writes its results. Returns true if it found a violation.
    fn work(
        &self,
        plan: &HuntPlan,
        record: BatchJournal<Judgement>,
        folder: &Path,
    ) -> anyhow::Result<bool> {
        let interrupted = InterruptFlag::install()?;
        let name = plan_name(&self.plan);
        let done = record.done();
        let stops = || interrupted.is_set();
        let jobs = jobs_or_cores(self.jobs);
        let most = most_runs(plan, jobs);
        let mut executor = Executor {
            jobs,
            stops: &stops,
            progress: RunProgress::new(done, most.max(done)),
            record,
            is_timed: matches!(plan.budget, Budget::Seconds(_)),
            elapsed_ms: 0,
        };
        let known = match done {
            0 => String::new(),
            known => format!(", {known} of them done before"),
        };
        executor.progress.print_line(&format!(
            "hunt {name}: at most {}{known}; {jobs} at a time",
            counted(most, "run")
        ));
        let found = hunt(plan, &mut executor);
        executor.progress.clear();
        finish(plan, &name, folder, &found?)
    }

    /// Executes a few runs and prints the number of runs and their time.
    fn estimate(&self, plan: &HuntPlan) -> anyhow::Result<()> {
        let jobs = jobs_or_cores(self.jobs);
        let base = Default::default();
        let (limit, abandoned) = (Default::default(), plan.conditions.abandoned);
        let measure = SeverityMeasure {
            limit,
            abandoned,
            base,
        };
        let cases = Search::new(plan, 0, Method::Uniform, measure).ask(BATCH);
        let places: Vec<usize> = (0..cases.len()).collect();
        let began = Instant::now();
        let attempt =
            |place: usize, stops: &dyn Fn() -> bool| judge(&cases[place], &plan.conditions, stops);
        run_parallel(&places, jobs, &|| false, attempt, |_| Ok(()))?;
        let most = most_runs(plan, jobs);
        let share = most as f64 / BATCH as f64;
        stderr_line!(
            "hunt {}: at most {}, {} with {jobs} at a time, estimated from {BATCH} runs",
            plan_name(&self.plan),
            counted(most, "run"),
            HumanDuration(began.elapsed().mul_f64(share))
        );
        let names = &plan.faults.names;
        stderr_line!(
            "{} to {} faults of {}: {}",
            plan.faults.min,
            plan.faults.max,
            counted(names.len(), "kind"),
            names.join(", ")
        );
        Ok(())
    }
}

/// Returns the largest number of runs of a plan. It is an estimate if the budget is a time.
fn most_runs(plan: &HuntPlan, jobs: NonZeroUsize) -> usize {
    let budget = match plan.budget {
        Budget::Runs(runs) => runs,
        Budget::Seconds(seconds) => (seconds * RUNS_PER_S * jobs.get() as f64) as usize,
    };
    let searches = plan.methods.len() * (budget + plan.shrink_runs);
    plan.scenarios.len() * (plan.seeds.len() + searches)
}

/// Writes and shows the results. Returns true if there is a violation.
fn finish(
    plan: &HuntPlan,
    name: &str,
    folder: &Path,
    results: &[AllocatorResult],
) -> anyhow::Result<bool> {
    let shown = shown(results);
    for each in &shown {
        write(folder, name, each)?;
    }
    // The runs without faults are of interest only if they have a violation.
    let is_of_interest =
        |each: &super::results::Shown<'_>| each.search.method.is_some() || each.finding.is_some();
    let shown: Vec<_> = shown.into_iter().filter(is_of_interest).collect();
    table(&shown).write_csv(folder, "results")?;
    write_atomically(
        &folder.join(PAGE),
        page::html(name, plan, &shown).as_bytes(),
    )?;
    let sentences: Vec<String> = shown.iter().map(|each| sentence(plan, each)).collect();
    stderr_line!("{}", bullets(&sentences));
    for each in &shown {
        if let Some((finding, files)) = &each.finding {
            stderr_line!("show     {}", command(finding, &least_path(folder, files)));
        }
    }
    stderr_line!("numbers  {}", folder.join("results.csv").display());
    stderr_line!("page     {}", folder.join(PAGE).display());
    Ok(!plan.maximizes_par2 && shown.iter().any(|each| each.finding.is_some()))
}
