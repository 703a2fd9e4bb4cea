//! Command line, output files and terminal output of `alliance tune`.

use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::slice;

use anyhow::{Context, bail};
use clap::Args;
use terminal::stderr_line;
use world_server::mission_args::Known;

use super::page::{Page, sentence};
use super::record::{Defaults, Executor, Unfinished, journal_name};
use super::search::{Method, population};
use super::task::Task;
use super::tuning::{Outcome, Tuned, tune};
use super::verdict::{AllocatorResult, TUNED, verdicts};
use crate::batch_journal::{BatchJournal, Header};
use crate::columns::{Entry, Table};
use crate::controllers::ControllerFiles;
use crate::exit_status;
use crate::figures::files;
use crate::interrupted::{InterruptFlag, Interrupted};
use crate::new_file::{make_folder, write_atomically};
use crate::progress::RunProgress;
use crate::shell::shell_quoted;
use crate::sweep::design::apply_change;
use crate::sweep::execution::{
    PLAN, command_words, jobs, jobs_or_cores, plan_name, read_plan, read_text, show_notes,
};
use crate::sweep::shard::Shard;
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
    /// Execute one of N parts, numbered from 0. The parts are searches: one per allocator and method
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Merge the journals of all shards from their folders
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["jobs", "shard"])]
    merge: Vec<PathBuf>,
    #[command(flatten)]
    controllers: ControllerFiles,
}

/// The search of an allocator by a method, with its journal.
struct Search {
    allocator: usize,
    method: Method,
    record: BatchJournal<Outcome>,
}

impl TuneCommand {
    /// Returns the controllers in Python that the plan names.
    pub fn controllers(&mut self) -> &mut ControllerFiles {
        &mut self.controllers
    }

    /// Runs the command. Exit status: 0 done, 2 invalid input, 3 a file cannot be written, 130 interrupted.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        // All inputs are read and checked before the first run.
        let (task, searches, folder) = match self.prepare(known) {
            Ok(prepared) => prepared,
            Err(error) => return exit_status("tune", Err(error), 2),
        };
        let done = self.work(&task, searches, &folder);
        if done.as_ref().is_err_and(|error| error.is::<Interrupted>()) {
            let paths = slice::from_ref(&self.plan);
            let mut again = command_words("tune", paths, self.out.as_deref(), self.jobs);
            if let Some(shard) = self.shard {
                again += &format!(" --shard {shard}");
            }
            again += &self.controllers.options();
            stderr_line!("interrupted; continue with\n  {again}");
        }
        let is_input = done.as_ref().is_err_and(|error| error.is::<Unfinished>());
        let failure = if is_input { 2 } else { 3 };
        exit_status("tune", done.map(|()| ExitCode::SUCCESS), failure)
    }

    fn prepare(&self, known: &Known) -> anyhow::Result<(Task, Vec<Search>, PathBuf)> {
        self.controllers.check()?;
        let text = read_text(&self.plan)?;
        let plan = read_plan(&self.plan, &text, known)?;
        let name = plan_name(&self.plan);
        let folder = self.out.clone();
        let folder = folder.unwrap_or_else(|| Path::new("tunings").join(&name));
        let header = Header::new("tuning", &name, self.controllers.digest(plan.digest())?);
        let notes = plan.notes.clone();
        let task = Task::of(plan).with_context(|| self.plan.display().to_string())?;
        let all = (0..task.allocators.len())
            .flat_map(|allocator| Method::ALL.map(|method| (allocator, method)));
        let mine = all.enumerate().filter(|(place, _)| {
            let shard = self.shard;
            shard.is_none_or(|shard| shard.contains(*place))
        });
        let mine: Vec<(usize, Method)> = mine.map(|(_, search)| search).collect();
        if mine.is_empty() {
            bail!(
                "the plan has only {} searches, one per allocator and method; use at most as many shards",
                task.allocators.len() * Method::ALL.len()
            );
        }
        let names = mine
            .iter()
            .map(|(allocator, method)| journal_name(&task.allocators[*allocator].name, *method));
        let names: Vec<String> = names.collect();
        let journals = match self.merge.is_empty() {
            true => Vec::new(),
            false => merged(&names, &self.merge)?,
        };
        make_folder(&folder)?;
        for (name, journal) in names.iter().zip(journals) {
            write_atomically(&folder.join(name), &journal)?;
        }
        let searches = mine.into_iter().zip(names);
        let searches = searches.map(|((allocator, method), name)| {
            let record = BatchJournal::open(folder.join(&name), &header)?;
            Ok(Search {
                allocator,
                method,
                record,
            })
        });
        let searches: Vec<Search> = searches.collect::<anyhow::Result<_>>()?;
        write_atomically(&folder.join(PLAN), text.as_bytes())?;
        show_notes(&notes);
        Ok((task, searches, folder))
    }

    fn work(&self, task: &Task, searches: Vec<Search>, folder: &Path) -> anyhow::Result<()> {
        let interrupted = InterruptFlag::install()?;
        let name = plan_name(&self.plan);
        let done = searches.iter().map(|search| search.record.done()).sum();
        let expected = expected(task, &searches);
        let jobs = jobs_or_cores(self.jobs);
        let mut progress = RunProgress::new(done, expected.max(done));
        let known = match done {
            0 => String::new(),
            known => format!(", {known} of them done before"),
        };
        let part = self
            .shard
            .map_or_else(String::new, |shard| format!(", shard {shard}"));
        let is_merge = !self.merge.is_empty();
        if !is_merge {
            progress.print_line(&format!(
                "tune {name}{part}: about {expected} runs{known}; {jobs} at a time"
            ));
        }
        let stops = || interrupted.is_set();
        let (mut defaults, mut found) = (Defaults::new(), Vec::new());
        for search in searches {
            let mut executor = Executor {
                task,
                record: search.record,
                jobs,
                stops: &stops,
                progress: &mut progress,
                defaults: &mut defaults,
                is_complete: is_merge,
            };
            found.push(tune(task, search.allocator, search.method, &mut executor)?);
        }
        progress.clear();
        if let Some(shard) = self.shard {
            stderr_line!(
                "shard {shard} done; when all shards are done, merge them with\n  alliance tune {} --merge {}",
                shell_quoted(&self.plan),
                shell_quoted(folder)
            );
            return Ok(());
        }
        let mut found = found.into_iter();
        let pairs = std::iter::from_fn(|| Some([found.next()?, found.next()?]));
        let found: Vec<Tuned> = pairs.map(Tuned::join).collect();
        finish(task, &name, folder, &found)
    }
}

/// Returns the contents of the named journals, each from the folder that has most of it.
fn merged(names: &[String], folders: &[PathBuf]) -> anyhow::Result<Vec<Vec<u8>>> {
    for folder in folders {
        if !folder.is_dir() {
            bail!("there is no folder {}", folder.display());
        }
    }
    let newest = |name: &String| {
        let mut longest: Option<(PathBuf, Vec<u8>)> = None;
        for path in folders.iter().map(|folder| folder.join(name)) {
            if !path.exists() {
                continue;
            }
            let bytes = fs::read(&path).with_context(|| path.display().to_string())?;
            let Some((other, known)) = &longest else {
                longest = Some((path, bytes));
                continue;
            };
            let common = known.len().min(bytes.len());
            if known[..common] != bytes[..common] {
                bail!(
                    "{} and {} have different results; different programs wrote them: repeat one of them",
                    other.display(),
                    path.display()
                );
            }
            if bytes.len() > known.len() {
                longest = Some((path, bytes));
            }
        }
        let (_, bytes) = longest.with_context(|| {
            format!("no folder contains {name}; run its shard, or name the shard's folder")
        })?;
        Ok(bytes)
    };
    names.iter().map(newest).collect()
}

/// Estimates the total number of runs. Races do not reduce the budget, the last generation always completes, and the defaults
/// of an allocator add one run per seed and condition.
fn expected(task: &Task, searches: &[Search]) -> usize {
    let tuning = &task.tuning;
    let seen = task.seen().count();
    let selection = tuning.selection.0.len() * seen;
    let test = tuning.test.0.len() * task.conditions.len();
    let mut of_defaults = vec![0; task.allocators.len()];
    let mut total = 0;
    for search in searches {
        let dimensions = task.allocators[search.allocator].parameters.len();
        let generation = population(dimensions) * tuning.seeds_per_candidate * seen;
        let generations = tuning.budget.div_ceil(generation) + 1;
        let seeds = tuning.training.0.len();
        let training = seeds.min(generations * tuning.seeds_per_candidate) * seen;
        of_defaults[search.allocator] = training + selection + test;
        total += tuning.budget + generation / 2 + tuning.finalists * selection + test;
    }
    total + of_defaults.iter().sum::<usize>()
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
        files::write(figure, folder)?;
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
            ("score", Entry::computed(candidate.score)),
            ("log_metric_ratio", Entry::computed(candidate.metric)),
            ("log_bytes_ratio", Entry::computed(candidate.bytes)),
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
                    (
                        "default",
                        Entry::computed(verdict.means.map(|means| means.0)),
                    ),
                    ("tuned", Entry::computed(verdict.means.map(|means| means.1))),
                    ("difference", difference),
                    ("difference_from", from),
                    ("difference_to", to),
                    ("percent", percent),
                    ("percent_from", percent_from),
                    ("percent_to", percent_to),
                    ("bytes_percent", Entry::computed(verdict.bytes_percent)),
                ]);
            }
        }
    }
    table
}
