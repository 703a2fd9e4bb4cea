//! Command line, output files and terminal output of `alliance bench`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use proto::program_build;
use scenario::Problem;
use terminal::counted;
use terminal::stderr_line;
use world_server::mission_args::Known;

use super::check::{check_content, check_program, refuted, sample};
use super::result::{BenchResult, VERSION};
use super::suite::{Suite, SuitePlan};
use super::table::{insert, markdown};
use crate::controllers::ControllerFiles;
use crate::figures::size::SizeOptions;
use crate::interrupted::{InterruptFlag, Interrupted};
use crate::new_file::write_atomically;
use crate::shell::shell_quoted;
use crate::sweep::execution::{PlanCommand, Work, command_words, jobs, jobs_or_cores, read_text};
use crate::sweep::journal::{Header, read_all};
use crate::sweep::run::{Row, RunResult, execute_run};
use crate::workers::run_parallel;
use crate::{distinct, exit_status};

const RESULT: &str = "result.json";

const TABLE: &str = "table.md";

/// Run a suite that never changes, or check a result of it
// An interrupted suite resumes where it stopped.
#[derive(Args, Clone, Debug)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct BenchCommand {
    #[command(subcommand)]
    check: Option<BenchSubcommand>,
    #[command(flatten)]
    run: BenchArguments,
}

#[derive(Subcommand, Clone, Debug)]
enum BenchSubcommand {
    /// Check a result: its content, and a share of its runs by repetition
    Check(CheckArguments),
}

#[derive(Args, Clone, Debug)]
struct BenchArguments {
    /// Name of the suite, such as v1
    // Absent beside a subcommand only.
    #[arg(value_name = "SUITE", required = true)]
    suite: Option<String>,
    /// Allocator to measure, repeatable [default: all, and the controllers]
    #[arg(long = "allocator", value_name = "NAME")]
    allocators: Vec<String>,
    /// Folder of the result [default: bench/SUITE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of concurrent runs [default: one per core]
    #[arg(long, value_name = "N", value_parser = jobs)]
    jobs: Option<NonZeroUsize>,
    /// Markdown file in which the table replaces the text after <!-- bench SUITE -->
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    #[command(flatten)]
    controllers: ControllerFiles,
}

#[derive(Args, Clone, Debug)]
struct CheckArguments {
    /// The result of a suite
    #[arg(value_name = "RESULT")]
    result: PathBuf,
    /// Share of each allocator's runs to repeat, %, at least one run
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0, value_parser = percent)]
    share: f64,
    /// Number of concurrent runs [default: one per core]
    #[arg(long, value_name = "N", value_parser = jobs)]
    jobs: Option<NonZeroUsize>,
    #[command(flatten)]
    controllers: ControllerFiles,
}

fn percent(text: &str) -> Result<f64, String> {
    let share: Option<f64> = text.parse().ok();
    let share = share.filter(|share| *share > 0.0 && *share <= 100.0);
    share.ok_or_else(|| "use a number above 0, up to 100".to_owned())
}

impl BenchCommand {
    /// Returns the controllers in Python that the command measures or repeats.
    pub fn controllers(&mut self) -> &mut ControllerFiles {
        match &mut self.check {
            Some(BenchSubcommand::Check(check)) => &mut check.controllers,
            None => &mut self.run.controllers,
        }
    }

    /// Runs the command. Exit status: 0 the result is written or agrees with the repeated runs, 1 failed or refuted runs, 2 invalid
    /// input, 3 a file cannot be written, 130 an interruption.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        if let Some(BenchSubcommand::Check(check)) = &self.check {
            return exit_status("bench check", check.run(known), 2);
        }
        match self.run.prepare(known) {
            Ok(prepared) => exit_status("bench", self.run.run(prepared), 3),
            Err(error) => exit_status("bench", Err(error), 2),
        }
    }
}

/// The execution of a suite by the machinery of sweeps. The result is made afterwards.
const STUDY: PlanCommand = PlanCommand {
    name: "bench",
    folder: "bench",
    prepare: |_, _| Ok(None),
    remarks: |_| Vec::new(),
    finish: |_, _, rows, _, _| {
        let mut rows = rows.iter();
        Ok(rows.all(|row| matches!(row.end, RunResult::Ended(_))))
    },
};

/// A suite that is ready to run.
struct Prepared {
    plan: SuitePlan,
    work: Work,
    folder: PathBuf,
    controllers: Option<String>,
    /// The document of `--table` with its text.
    document: Option<(PathBuf, String)>,
}

impl BenchArguments {
    fn prepare(&self, known: &Known) -> anyhow::Result<Prepared> {
        let suite = Suite::find(self.suite.as_deref().unwrap_or_default())?;
        let allocators = self.allocators(known);
        let plan = suite.plan(&allocators, known)?;
        let document = self.table.as_ref().map(|path| {
            let text = read_text(path)?;
            let Some(text) = insert(&text, suite.name, "") else {
                let what = format!(
                    "there are no lines <!-- bench {} --> and <!-- end -->",
                    suite.name
                );
                let remedy = "add them where the table belongs";
                return Err(Problem::with_source(path.display().to_string(), what, remedy).into());
            };
            anyhow::Ok((path.clone(), text))
        });
        let document = document.transpose()?;
        let folder = self.out.clone();
        let folder = folder.unwrap_or_else(|| Path::new(STUDY.folder).join(suite.name));
        let header = Header {
            sweep: suite.name.to_owned(),
            version: VERSION.to_owned(),
            digest: self.controllers.digest(plan.plan.digest())?,
            design: plan.plan.design.clone(),
            check: false,
            comparison: None,
        };
        let sheet = SizeOptions::default().sheet()?;
        let stated = (plan.plan.clone(), plan.text.as_str());
        let work = Work::open(stated, header, folder.clone(), None, sheet)?;
        Ok(Prepared {
            plan,
            work,
            folder,
            controllers: digest(&self.controllers)?,
            document,
        })
    }

    /// Returns the stated allocators and all controllers, or else everything that the program contains. In the process
    /// that executes controllers, the vocabulary contains these, too.
    fn allocators(&self, known: &Known) -> Vec<String> {
        let controllers = self.controllers.files.iter().map(|file| file.name.clone());
        let all = known.vocabulary.allocators.iter();
        let stated = match self.allocators.is_empty() {
            true => all.map(|allocator| allocator.name.to_owned()).collect(),
            false => self.allocators.clone(),
        };
        distinct(stated.into_iter().chain(controllers))
    }

    fn run(&self, prepared: Prepared) -> anyhow::Result<ExitCode> {
        let suite = prepared.plan.suite.name;
        let paths = [PathBuf::from(suite)];
        let mut again = command_words(STUDY.name, &paths, self.out.as_deref(), self.jobs);
        for allocator in &self.allocators {
            again += &format!(" --allocator {allocator}");
        }
        if let Some(table) = &self.table {
            again += &format!(" --table {}", shell_quoted(table));
        }
        again += &self.controllers.options();
        let jobs = jobs_or_cores(self.jobs);
        if !prepared.work.run(jobs, &STUDY, &again, suite)? {
            stderr_line!("no result: a suite needs all runs");
            return Ok(ExitCode::FAILURE);
        }
        let folders = [prepared.folder.clone()];
        let (_, rows) = read_all(&folders)?.context("the journal has disappeared")?;
        let rows: Vec<Row> = rows.into_values().collect();
        let stored = rows.iter().find(|row| row.build != program_build::get());
        if let Some(row) = stored {
            bail!(
                "{}: build {} made run {}, and this is another build; name a new folder with --out, or remove that folder",
                prepared.folder.display(),
                row.build,
                row.run
            );
        }
        let result = BenchResult::new(&prepared.plan, prepared.controllers, &rows);
        let result = result.map_err(anyhow::Error::msg)?;
        let path = prepared.folder.join(RESULT);
        let text = serde_json::to_string_pretty(&result)? + "\n";
        write_atomically(&path, text.as_bytes())?;
        let table = markdown(&result, &prepared.plan);
        write_atomically(&prepared.folder.join(TABLE), table.as_bytes())?;
        if let Some((file, text)) = &prepared.document {
            let text = insert(text, suite, &table).context("the markers have disappeared")?;
            write_atomically(file, text.as_bytes())?;
        }
        stderr_line!("{table}");
        stderr_line!("result   {}", path.display());
        stderr_line!(
            "check    alliance bench check {}{}",
            shell_quoted(&path),
            self.controllers.options()
        );
        Ok(ExitCode::SUCCESS)
    }
}

impl CheckArguments {
    fn run(&self, known: &Known) -> anyhow::Result<ExitCode> {
        let file = self.result.display().to_string();
        let text = read_text(&self.result)?;
        let result: BenchResult = serde_json::from_str(&text).map_err(|error| {
            let what = format!("this is no result of alliance bench: {error}");
            Problem::with_source(&file, what, "docs/bench.schema.json describes it")
        })?;
        let in_file = || file.clone();
        let suite = Suite::find(&result.suite).with_context(in_file)?;
        check_program(&file, &result, digest(&self.controllers)?.as_deref())?;
        let plan = suite
            .plan(&result.allocators, known)
            .with_context(in_file)?;
        check_content(&file, &result, &plan)?;

        let interrupted = InterruptFlag::install()?;
        let runs = sample(&result, self.share / 100.0);
        let attempt = |run, stops: &dyn Fn() -> bool| execute_run(&plan.plan, run, stops);
        let (mut repeated, mut differences) = (0, Vec::new());
        let stops = || interrupted.is_set();
        run_parallel(&runs, jobs_or_cores(self.jobs), &stops, attempt, |row| {
            repeated += 1;
            differences.extend(refuted(&result, &plan, &row).map(|what| (row.run, what)));
            Ok(())
        })?;
        if repeated < runs.len() {
            stderr_line!(
                "interrupted: {repeated} of {} repeated",
                counted(runs.len(), "run")
            );
            return Err(Interrupted.into());
        }
        // The order in which the runs ended depends on the threads.
        differences.sort();
        for (_, difference) in &differences {
            stderr_line!("{file}: {difference}");
        }
        stderr_line!(
            "{file}: suite {}, {}: {repeated} of {} repeated, {} differ",
            result.suite,
            counted(result.allocators.len(), "allocator"),
            counted(result.runs.len(), "run"),
            differences.len()
        );
        Ok(ExitCode::from(u8::from(!differences.is_empty())))
    }
}

/// Returns the digest of the controllers, or `None` without any.
fn digest(controllers: &ControllerFiles) -> anyhow::Result<Option<String>> {
    controllers.check()?;
    match controllers.files.is_empty() {
        true => Ok(None),
        false => controllers.digest(String::new()).map(Some),
    }
}
