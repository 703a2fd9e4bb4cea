//! Command line, output files and terminal output of `alliance tune`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::slice;

use anyhow::Context;
use clap::Args;
use terminal::stderr_line;
use world_server::mission_args::Known;

use super::page::{Page, sentence};
use super::record::{Executor, Header, SearchJournal};
use super::search::{Method, population};
use super::task::{Allocator, Task};
use super::tuning::{TrialExecutor, Tuned, tune};
use super::verdict::{AllocatorResult, TUNED, verdicts};
use crate::columns::{Entry, Table};
use crate::exit_status;
use crate::interrupted::{InterruptFlag, Interrupted};
use crate::new_file::{make_folder, write_atomically};
use crate::progress::RunProgress;
use crate::sweep::design::apply_change;
use crate::sweep::execution::{
    PLAN, command_words, jobs, jobs_or_cores, plan_name, read_plan, read_text, shell_quoted,
};
use crate::table::bullets;

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
            Err(error) => return exit_status("tune", Err(error), 2),
        };
        let done = self.work(&task, record, &folder);
        if done.as_ref().is_err_and(|error| error.is::<Interrupted>()) {
            let paths = slice::from_ref(&self.plan);
            let again = command_words("tune", paths, self.out.as_deref(), self.jobs);
            stderr_line!("interrupted; continue with\n  {again}");
        }
        exit_status("tune", done.map(|()| ExitCode::SUCCESS), 3)
    }

    fn prepare(&self, known: &Known) -> anyhow::Result<(Task, SearchJournal, PathBuf)> {
        let text = read_text(&self.plan)?;
        let plan = read_plan(&self.plan, &text, known)?;
        let name = plan_name(&self.plan);
        let folder = self.out.clone();
        let folder = folder.unwrap_or_else(|| Path::new("tunings").join(&name));
        let header = Header {
            tune: name,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            digest: plan.digest(),
        };
        let task = Task::of(plan).with_context(|| self.plan.display().to_string())?;
        make_folder(&folder)?;
        let record = SearchJournal::open(&folder, &header)?;
        write_atomically(&folder.join(PLAN), text.as_bytes())?;
        Ok((task, record, folder))
    }

    fn work(&self, task: &Task, record: SearchJournal, folder: &Path) -> anyhow::Result<()> {
        let interrupted = InterruptFlag::install()?;
        let name = plan_name(&self.plan);
        let done = record.done();
        let stops = || interrupted.is_set();
        let mut working = Executor {
            task,
            jobs: jobs_or_cores(self.jobs),
            stops: &stops,
            progress: RunProgress::new(done, expected(task).max(done)),
            record,
        };
        let known = match done {
            0 => String::new(),
            known => format!(", {known} of them done before"),
        };
        working.report_progress(&format!(
            "tune {name}: about {} runs{known}; {} at a time",
            expected(task),
            working.jobs
        ));
        let found: anyhow::Result<Vec<Tuned>> = (0..task.allocators.len())
            .map(|allocator| tune(task, allocator, &mut working))
            .collect();
        working.progress.clear();
        finish(task, &name, folder, &found?)
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
    write_atomically(
        &folder.join(TUNED),
        scenario(task, name, &results)?.as_bytes(),
    )?;
    candidates(&results).write_csv(folder, "candidates")?;
    tests(&results).write_csv(folder, "test")?;
    let figures = super::figures::figures(task, &results)?;
    for figure in figures.iter().flatten() {
        figure.write(folder)?;
    }
    let page = Page {
        name,
        task,
        results: &results,
        figures: &figures,
    };
    write_atomically(&folder.join(PAGE), page.html().as_bytes())?;
    let sentences = results.iter().map(|result| sentence(task, result));
    stderr_line!("{}", bullets(&sentences.collect::<Vec<_>>()));
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
    // The name of a plan is a file name, with other rules than the name of a scenario.
    let plain = name.chars().take(26).map(|letter| {
        let is_valid = letter.is_ascii_alphanumeric() || letter == '_';
        if is_valid { letter } else { '-' }
    });
    table.insert(
        "name".to_owned(),
        toml::Value::String(format!("tuned-{}", plain.collect::<String>())),
    );
    let mut text = format!(
        "# {} with parameters found by alliance tune {name}.toml.\n",
        task.conditions[0].name
    );
    for (place, result) in results.iter().enumerate() {
        let best = result.tuned.best(result.chosen);
        let verdict = &result.verdicts[result.chosen][0];
        let allocator = result.allocator;
        text += &format!("# {}\n", sentence(task, result));
        if result.is_better() {
            for each in allocator.changes(Some(&best.values)).into_iter().skip(1) {
                apply_change(&mut table, &each)?;
            }
            for (place, parameter) in allocator.parameters.iter().enumerate() {
                let (value, bounds) = (best.values[place], parameter.bounds(&allocator.parameters));
                let note = parameter.bound_reached(&best.values, place);
                let note = note.map_or_else(String::new, |note| format!(", {note}"));
                text += &format!("#   {} = {value}, of {bounds}{note}\n", parameter.key);
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

/// Returns a row per candidate, with a column per parameter of every allocator.
fn candidates(results: &[AllocatorResult<'_>]) -> Table {
    let each = results.iter().flat_map(|result| {
        let candidates = result.tuned.candidates.iter();
        candidates.map(move |candidate| (result, candidate))
    });
    Table::of_rows(each.map(|(result, candidate)| {
        let parameters = results.iter().flat_map(move |other| {
            let values = candidate.values.iter().copied();
            let values = values.map(Some).chain(std::iter::repeat(None));
            let is_own = other.allocator.name == result.allocator.name;
            let values = values.map(move |value| Entry::number(value.filter(|_| is_own)));
            let keys = other.allocator.parameters.iter();
            keys.map(|parameter| parameter.key.as_str()).zip(values)
        });
        let row = [
            ("allocator", Entry::text(&result.allocator.name)),
            ("method", Entry::text(candidate.method.as_str())),
            ("generation", Entry::count(candidate.generation)),
            ("runs", Entry::count(candidate.own_runs)),
            ("dropped", Entry::Flag(candidate.dropped)),
            ("score", Entry::number(candidate.score)),
            ("log_metric_ratio", Entry::number(candidate.metric)),
            ("log_bytes_ratio", Entry::number(candidate.bytes)),
        ];
        row.into_iter().chain(parameters)
    }))
}

fn tests(results: &[AllocatorResult<'_>]) -> Table {
    let mut table = Table::default();
    for result in results {
        for (method, verdicts) in Method::ALL.iter().zip(&result.verdicts) {
            for verdict in verdicts {
                let [difference, from, to] = Entry::with_interval(verdict.difference);
                let [percent, percent_from, percent_to] =
                    Entry::with_interval(Some(verdict.percent));
                table.add([
                    ("allocator", Entry::text(&result.allocator.name)),
                    ("method", Entry::text(method.as_str())),
                    ("condition", Entry::text(&verdict.condition)),
                    ("n", Entry::count(verdict.n)),
                    ("default", Entry::number(verdict.means.map(|means| means.0))),
                    ("tuned", Entry::number(verdict.means.map(|means| means.1))),
                    ("difference", difference),
                    ("difference_from", from),
                    ("difference_to", to),
                    ("percent", percent),
                    ("percent_from", percent_from),
                    ("percent_to", percent_to),
                    ("bytes_percent", Entry::number(verdict.bytes_percent)),
                ]);
            }
        }
    }
    table
}
