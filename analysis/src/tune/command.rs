//! Command line, output files and terminal output of `alliance tune`.

use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread::available_parallelism;

use anyhow::Context;
use clap::Args;
use scenario::decode_text;
use terminal::stderr_line;
use world_server::mission_args::Known;

use super::page::Page;
use super::record::{Executor, Header, SearchJournal, StoppedSearch};
use super::result::{AllocatorResult, TUNED};
use super::search::population;
use super::task::{Allocator, Task};
use super::tuning::{TrialExecutor, Tuned, tune};
use super::verdict::{TestComparison, verdicts};
use crate::interrupted::InterruptFlag;
use crate::new_file::write_atomically;
use crate::progress::RunProgress;
use crate::sweep::design::apply_change;
use crate::sweep::execution::{PLAN, jobs, read_plan, shell_quoted};
use crate::sweep::results::Values::{Flags, Integers, Numbers, Texts};
use crate::sweep::results::{Column, Values, csv};

const PAGE: &str = "tuning.html";

/// Search for good allocator parameters, tested on unseen seeds
// The search never uses the test seeds. An interrupted search resumes where it stopped.
#[derive(Args, Clone, Debug)]
pub struct TuneCommand {
    /// Plan in TOML with a table [tune]
    #[arg(value_name = "FILE")]
    plan: PathBuf,
    /// Folder of the results [default: tunings/FILE without .toml]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of concurrent runs [default: one per core]
    #[arg(long, value_name = "N", value_parser = jobs)]
    jobs: Option<NonZeroUsize>,
}

impl TuneCommand {
    /// Runs the command. Exit status: 0 done, 1 interrupted, 2 invalid input, 3 a file cannot be written.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        // All inputs are read and checked before the first run.
        let (task, record, folder) = match self.prepare(known) {
            Ok(prepared) => prepared,
            Err(error) => {
                stderr_line!("alliance tune: {error:#}");
                return ExitCode::from(2);
            }
        };
        match self.work(&task, record, &folder) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) if error.is::<StoppedSearch>() => {
                stderr_line!("interrupted; continue with\n  {}", self.again());
                ExitCode::from(1)
            }
            Err(error) => {
                stderr_line!("alliance tune: {error:#}");
                ExitCode::from(3)
            }
        }
    }

    fn name(&self) -> String {
        let stem = self.plan.file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    fn prepare(&self, known: &Known) -> anyhow::Result<(Task, SearchJournal, PathBuf)> {
        let file = self.plan.display().to_string();
        let bytes = fs::read(&self.plan).with_context(|| file.clone())?;
        let text = decode_text(&file, bytes)?;
        let plan = read_plan(&self.plan, &text, known)?;
        let header = Header {
            tune: self.name(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            digest: plan.digest(),
        };
        let task = Task::of(plan).with_context(|| file.clone())?;
        let folder = match &self.out {
            Some(folder) => folder.clone(),
            None => Path::new("tunings").join(self.name()),
        };
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let record = SearchJournal::open(&folder, &header)?;
        write_atomically(&folder, PLAN, text.as_bytes())?;
        Ok((task, record, folder))
    }

    fn work(&self, task: &Task, record: SearchJournal, folder: &Path) -> anyhow::Result<()> {
        let interrupted = InterruptFlag::install()?;
        let jobs = self.jobs.or_else(|| available_parallelism().ok());
        let done = record.done();
        let stops = || interrupted.is_set();
        let mut working = Executor {
            task,
            jobs: jobs.unwrap_or(NonZeroUsize::MIN),
            stops: &stops,
            progress: RunProgress::new(done, expected(task).max(done)),
            record,
        };
        let known = match done {
            0 => String::new(),
            known => format!(", {known} of them done before"),
        };
        working.report_progress(&format!(
            "tune {}: about {} runs{known}; {} at a time",
            self.name(),
            expected(task),
            working.jobs
        ));
        let found: anyhow::Result<Vec<Tuned>> = (0..task.allocators.len())
            .map(|allocator| tune(task, allocator, &mut working))
            .collect();
        working.progress.clear();
        finish(task, &self.name(), folder, &found?)
    }

    /// Returns the command that resumes the search.
    fn again(&self) -> String {
        let mut words = vec!["alliance tune".to_owned(), shell_quoted(&self.plan)];
        if let Some(out) = &self.out {
            words.push(format!("--out {}", shell_quoted(out)));
        }
        if let Some(jobs) = self.jobs {
            words.push(format!("--jobs {jobs}"));
        }
        words.join(" ")
    }
}

/// Estimates the total number of runs. Races do not reduce the budget, the last generation always completes, and the defaults
/// add one run per seed and condition.
fn expected(task: &Task) -> usize {
    let tuning = &task.tuning;
    let seen = task.seen().count();
    let of = |allocator: &Allocator| {
        let generation = population(allocator.parameters.len()) * tuning.seeds_per_candidate * seen;
        let generations = tuning.budget.div_ceil(generation) + 1;
        let seeds = tuning.training.0.len();
        let defaults = seeds.min(generations * tuning.seeds_per_candidate) * seen;
        2 * (tuning.budget + generation / 2) + defaults
    };
    let search: usize = task.allocators.iter().map(of).sum();
    let selection = tuning.selection.0.len() * seen * (2 * tuning.finalists + 1);
    let test = 3 * tuning.test.0.len() * task.conditions.len();
    search + task.allocators.len() * (selection + test)
}

fn finish(task: &Task, name: &str, folder: &Path, found: &[Tuned]) -> anyhow::Result<()> {
    let results: Vec<AllocatorResult<'_>> = task
        .allocators
        .iter()
        .zip(found)
        .map(|(allocator, tuned)| AllocatorResult {
            allocator,
            tuned,
            chosen: tuned.chosen(),
            verdicts: [0, 1].map(|method| verdicts(task, tuned, method)),
        })
        .collect();
    write_atomically(folder, TUNED, scenario(task, name, &results)?.as_bytes())?;
    for (name, columns) in [
        ("candidates.csv", candidates(&results)),
        ("test.csv", tests(&results)),
    ] {
        let rows = columns.first().map_or(0, Column::rows);
        write_atomically(folder, name, &csv(&columns, rows)?)?;
    }
    let figures = super::figures::figures(task, &results)?;
    for figure in figures.iter().flatten() {
        write_atomically(
            folder,
            &format!("{}.svg", figure.name),
            figure.svg.as_bytes(),
        )?;
    }
    let page = Page {
        name,
        task,
        results: &results,
        figures: &figures,
    };
    write_atomically(folder, PAGE, page.html().as_bytes())?;
    for result in &results {
        stderr_line!("- {}", super::page::sentence(task, result));
    }
    stderr_line!(
        "scenario alliance run {}",
        shell_quoted(&folder.join(TUNED))
    );
    stderr_line!("numbers  {}", folder.join("test.csv").display());
    stderr_line!("page     {}", folder.join(PAGE).display());
    Ok(())
}

/// Creates the first mission without faults as a scenario with the best values of all allocators. It selects the first allocator.
fn scenario(task: &Task, name: &str, results: &[AllocatorResult<'_>]) -> anyhow::Result<String> {
    let mut table = task.plan.scenario(0).map_err(anyhow::Error::msg)?;
    table.remove("faults");
    table.insert(
        "name".to_owned(),
        toml::Value::String(format!("{name}-tuned")),
    );
    let mut text = format!(
        "# {} with parameters found by alliance tune {name}.toml.\n",
        task.conditions[0].name
    );
    for (place, result) in results.iter().enumerate() {
        let best = result.tuned.best(result.chosen);
        let verdict = &result.verdicts[result.chosen][0];
        let allocator = result.allocator;
        text += &format!("# {}\n", super::page::sentence(task, result));
        if result.is_better() {
            for each in allocator.changes(Some(&best.values)).into_iter().skip(1) {
                apply_change(&mut table, &each).map_err(anyhow::Error::msg)?;
            }
            for (parameter, value) in allocator.parameters.iter().zip(&best.values) {
                let bounds = parameter.bounds(&allocator.parameters);
                text += &format!("#   {} = {value}, of {bounds}\n", parameter.key);
            }
        } else {
            text += &format!(
                "#   Defaults kept: no significant improvement on {} test seeds.\n",
                verdict.n
            );
        }
        if place == 0 {
            table.insert(
                "allocator".to_owned(),
                toml::Value::String(allocator.name.clone()),
            );
        }
    }
    Ok(format!("{text}{table}"))
}

#[derive(Default)]
struct Filling(Vec<Column>);

impl Filling {
    fn column(&mut self, name: &str, values: Values) {
        let name = name.to_owned();
        self.0.push(Column { name, values });
    }
}

fn candidates(results: &[AllocatorResult<'_>]) -> Vec<Column> {
    let all: Vec<_> = results
        .iter()
        .flat_map(|result| {
            result
                .tuned
                .candidates
                .iter()
                .map(move |candidate| (result, candidate))
        })
        .collect();
    let each = || all.iter();
    let mut table = Filling::default();
    let texts = |values: Vec<String>| Texts(values.into_iter().map(Some).collect());
    table.column(
        "allocator",
        texts(
            each()
                .map(|(result, _)| result.allocator.name.clone())
                .collect(),
        ),
    );
    table.column(
        "method",
        texts(
            each()
                .map(|(_, candidate)| candidate.method.as_str().to_owned())
                .collect(),
        ),
    );
    table.column(
        "generation",
        Integers(
            each()
                .map(|(_, candidate)| Some(candidate.generation as i64))
                .collect(),
        ),
    );
    table.column(
        "runs",
        Integers(
            each()
                .map(|(_, candidate)| Some(candidate.own_runs as i64))
                .collect(),
        ),
    );
    table.column(
        "dropped",
        Flags(
            each()
                .map(|(_, candidate)| Some(candidate.dropped))
                .collect(),
        ),
    );
    table.column(
        "score",
        Numbers(each().map(|(_, candidate)| Some(candidate.score)).collect()),
    );
    table.column(
        "log_metric_ratio",
        Numbers(
            each()
                .map(|(_, candidate)| Some(candidate.metric))
                .collect(),
        ),
    );
    table.column(
        "log_bytes_ratio",
        Numbers(each().map(|(_, candidate)| Some(candidate.bytes)).collect()),
    );
    for result in results {
        for (place, parameter) in result.allocator.parameters.iter().enumerate() {
            let is_same =
                |other: &AllocatorResult<'_>| other.allocator.name == result.allocator.name;
            let values =
                each().map(|(other, candidate)| is_same(other).then(|| candidate.values[place]));
            table.column(&parameter.key, Numbers(values.collect()));
        }
    }
    table.0
}

fn tests(results: &[AllocatorResult<'_>]) -> Vec<Column> {
    let mut rows = Vec::new();
    for result in results {
        for (method, verdicts) in super::search::Method::ALL.iter().zip(&result.verdicts) {
            rows.extend(
                verdicts
                    .iter()
                    .map(|verdict| (result, method.as_str(), verdict)),
            );
        }
    }
    let each = || rows.iter();
    let mut table = Filling::default();
    let texts = |values: Vec<String>| Texts(values.into_iter().map(Some).collect());
    table.column(
        "allocator",
        texts(
            each()
                .map(|(result, ..)| result.allocator.name.clone())
                .collect(),
        ),
    );
    table.column(
        "method",
        texts(each().map(|(_, method, _)| (*method).to_owned()).collect()),
    );
    table.column(
        "condition",
        texts(
            each()
                .map(|(.., verdict)| verdict.condition.clone())
                .collect(),
        ),
    );
    table.column(
        "n",
        Integers(each().map(|(.., verdict)| Some(verdict.n as i64)).collect()),
    );
    let number = |of: fn(&TestComparison) -> Option<f64>| {
        Numbers(each().map(|(.., verdict)| of(verdict)).collect())
    };
    table.column("default", number(|verdict| Some(verdict.means?.0)));
    table.column("tuned", number(|verdict| Some(verdict.means?.1)));
    table.column("difference", number(|verdict| Some(verdict.difference?.0)));
    table.column(
        "difference_from",
        number(|verdict| Some(verdict.difference?.1.0)),
    );
    table.column(
        "difference_to",
        number(|verdict| Some(verdict.difference?.1.1)),
    );
    table.column("percent", number(|verdict| Some(verdict.percent.0)));
    table.column("percent_from", number(|verdict| Some(verdict.percent.1.0)));
    table.column("percent_to", number(|verdict| Some(verdict.percent.1.1)));
    table.column(
        "bytes_percent",
        number(|verdict| Some(verdict.bytes_percent)),
    );
    table.0
}
