//! Execution of a plan for any command: all runs or a shard, from the start or resumed, with journals that can be merged.

use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread::available_parallelism;

use anyhow::{Context, bail};
use clap::Args;
use indicatif::HumanDuration;
use missions::Registry;
use scenario::decode_text;
use terminal::{counted, stderr_line};
use tokio::time::Instant;
use world_server::mission_args::{Known, read_scenario};

use super::comparison::Comparison;
use super::journal::{self, Header, RowsByRun, note_of_builds, read_all};
use super::lines::LineFile;
use super::plan::Plan;
use super::run::{Failure, Row, RunResult, execute_run};
use super::shard::Shard;
use crate::controllers::ControllerFiles;
use crate::figures::canvas::Sheet;
use crate::figures::size::SizeOptions;
use crate::interrupted::{InterruptFlag, Interrupted};
use crate::new_file::{make_folder, write_atomically};
use crate::progress::RunProgress;
use crate::shell::shell_quoted;
use crate::strategies;
use crate::strategies::command::StrategiesStudy;
use crate::workers::run_parallel;
use crate::{all_done, exit_status};

/// The names of files and folders in the folder of a sweep.
pub const PLAN: &str = "plan.toml";
pub const SCENARIO: &str = "scenario.toml";
pub const FAILURES: &str = "failures";

/// The number of runs from which a dry run estimates the time of all.
const SAMPLE: usize = 16;

/// The largest number of missing runs that a message lists.
const SHOWN: usize = 20;

#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Plan in TOML; with --merge: folders with the journals of shards
    #[arg(value_name = "FILE|DIR", required = true)]
    paths: Vec<PathBuf>,
    /// Folder of the results [default: FILE's name; with --merge the first DIR]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of concurrent runs [default: one per core]
    #[arg(long, value_name = "N", value_parser = jobs)]
    jobs: Option<NonZeroUsize>,
    /// Execute one of N parts, numbered from 0: run I and every N-th after it
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Merge the journals of all shards
    #[arg(long, conflicts_with_all = ["jobs", "shard"])]
    merge: bool,
    /// Print the number of runs, their time and what the plan cannot find
    #[arg(long, conflicts_with_all = ["merge", "out", "scenario"])]
    dry_run: bool,
    /// Print the scenario of one run and the command that executes it
    #[arg(long, value_name = "RUN", conflicts_with_all = ["jobs", "shard", "merge", "out"])]
    scenario: Option<usize>,
    #[command(flatten)]
    controllers: ControllerFiles,
    #[command(flatten, next_help_heading = "Figures")]
    size: SizeOptions,
}

/// The parts of plan execution that depend on the subcommand.
pub struct PlanCommand {
    pub name: &'static str,
    /// The parent folder of the results by default.
    pub folder: &'static str,
    /// Checks the subcommand's requirements of a plan with the given number of concurrent runs. Returns the data that the
    /// journal stores beside the runs.
    pub prepare: fn(&mut Plan, NonZeroUsize) -> anyhow::Result<Option<Comparison>>,
    /// Returns what the plan cannot find, as lines to show before the first run.
    pub remarks: fn(&Header) -> Vec<String>,
    pub finish: Finish,
}

/// A function that writes and shows the results from all rows in order, including failed runs, in a folder, with figures
/// of this size. The text contains the arguments that state the plan; `None` after a merge. It returns `true` if no run failed.
pub type Finish = fn(&Path, &Header, &[Row], Option<&str>, &Sheet) -> anyhow::Result<bool>;

/// The work that remains after the arguments are checked. It returns `true` if all runs are done and none failed.
type Task<'t> = Box<dyn FnOnce() -> anyhow::Result<bool> + 't>;

/// A sweep, or a shard of it, that is ready to run.
pub struct Work {
    plan: Plan,
    header: Header,
    folder: PathBuf,
    shard: Option<Shard>,
    journal: LineFile,
    done: RowsByRun,
    sheet: Sheet,
}

impl Arguments {
    /// Runs the command. Exit status: 0 all runs are done, 1 failed runs, 2 invalid input or missing runs, 3 a file cannot be written,
    /// 130 an interruption. Incomplete missions are not failures.
    #[must_use]
    pub fn run(&self, known: &Known, study: &PlanCommand) -> ExitCode {
        // All inputs are read and checked before the first run.
        match self.prepare(known, study) {
            Ok(task) => exit_status(study.name, task().map(all_done), 3),
            Err(error) => exit_status(study.name, Err(error), 2),
        }
    }

    /// Returns the controllers in Python that the plan names.
    pub fn controllers(&mut self) -> &mut ControllerFiles {
        &mut self.controllers
    }

    #[must_use]
    pub fn jobs(&self) -> NonZeroUsize {
        jobs_or_cores(self.jobs)
    }

    /// Reads and checks the plan file that the arguments name.
    pub fn plan(&self, known: &Known) -> anyhow::Result<Plan> {
        let (file, text) = self.file()?;
        read_plan(file, &text, known)
    }

    /// Returns the path of the plan and its text.
    fn file(&self) -> anyhow::Result<(&Path, String)> {
        let [file] = &self.paths[..] else {
            bail!("name one FILE; only --merge takes several DIRs");
        };
        Ok((file, read_text(file)?))
    }

    fn folder(&self, parent: &str, name: &str) -> PathBuf {
        let default = || Path::new(parent).join(name);
        self.out.clone().unwrap_or_else(default)
    }

    /// Returns the study of a plan with `[strategies]`, or `None` for any other plan.
    pub(super) fn strategies(&self) -> anyhow::Result<Option<StrategiesStudy>> {
        if self.merge {
            return Ok(None);
        }
        let (file, text) = self.file()?;
        let Some(design) = strategies::design::Design::parse(&file.display().to_string(), &text)?
        else {
            return Ok(None);
        };
        if self.shard.is_some() || self.scenario.is_some() || self.dry_run {
            bail!(
                "{}: [strategies] allows only --out and --jobs; leave the other options out",
                file.display()
            );
        }
        let name = plan_name(file);
        Ok(Some(StrategiesStudy {
            folder: self.folder("sweeps", &name),
            name,
            design,
            jobs: self.jobs(),
        }))
    }

    fn prepare<'t>(&'t self, known: &Known, study: &'t PlanCommand) -> anyhow::Result<Task<'t>> {
        let sheet = self.size.sheet()?;
        self.controllers.check()?;
        if self.merge {
            return self.gather(study, sheet);
        }
        let (file, text) = self.file()?;
        let mut plan = read_plan(file, &text, known)?;
        if plan.tuning.is_some() {
            bail!("{}: this is a plan for alliance tune", file.display());
        }
        let comparison =
            (study.prepare)(&mut plan, self.jobs()).with_context(|| file.display().to_string())?;
        let runs = plan.design.runs().unwrap_or_default();
        if let Some(run) = self.scenario {
            if run >= runs {
                bail!(
                    "there is no run {run}; runs are numbered from 0 to {}",
                    runs - 1
                );
            }
            return Ok(Box::new(move || self.print(&plan, run)));
        }
        let name = plan_name(file);
        let folder = self.folder(study.folder, &name);
        let header = Header {
            sweep: name,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            digest: self.controllers.digest(plan.digest())?,
            design: plan.design.clone(),
            check: plan.check,
            comparison,
        };
        let notes = plan.notes.clone();
        if self.dry_run {
            show_notes(&notes);
            return Ok(Box::new(move || self.estimate(&plan, &header, study)));
        }
        let work = Work::open((plan, &text), header, folder, self.shard, sheet)?;
        show_notes(&notes);
        let stated = shell_quoted(file) + &self.controllers.options();
        Ok(Box::new(move || {
            work.run(self.jobs(), study, &self.again(study), &stated)
        }))
    }

    fn gather<'t>(&self, study: &'t PlanCommand, sheet: Sheet) -> anyhow::Result<Task<'t>> {
        let folders = &self.paths;
        let names: Vec<String> = folders.iter().map(|f| f.display().to_string()).collect();
        let Some((header, rows)) = read_all(folders)? else {
            bail!("no journal of a sweep in {}", names.join(", "));
        };
        let runs = header.design.runs().unwrap_or_default();
        let missing: Vec<String> = (0..runs)
            .filter(|run| !rows.contains_key(run))
            .map(|run| run.to_string())
            .collect();
        if !missing.is_empty() {
            let named = missing.len().min(SHOWN);
            let more = if missing.len() > named { ", …" } else { "" };
            bail!(
                "{} of {runs} runs are missing: {}{more}; repeat their shards, or the whole sweep with --out {}",
                missing.len(),
                missing[..named].join(", "),
                names[0]
            );
        }
        let out = self.out.clone().unwrap_or_else(|| folders[0].clone());
        make_folder(&out)?;
        for name in [PLAN, SCENARIO] {
            let path = folders[0].join(name);
            let text = fs::read(&path).with_context(|| path.display().to_string())?;
            write_atomically(&out.join(name), &text)?;
        }
        Ok(Box::new(move || {
            finish(&out, &header, rows, study, (None, sheet))
        }))
    }

    /// Executes a few runs and prints the estimated time of all. Returns `true`.
    fn estimate(&self, plan: &Plan, header: &Header, study: &PlanCommand) -> anyhow::Result<bool> {
        let all = plan.design.runs().unwrap_or_default();
        let mine: Vec<usize> = (0..all)
            .filter(|run| self.shard.is_none_or(|shard| shard.contains(*run)))
            .collect();
        let tried = mine.len().min(SAMPLE);
        let sample: Vec<usize> = (0..tried)
            .map(|place| mine[place * mine.len() / tried])
            .collect();
        let began = Instant::now();
        let attempt = |run, stops: &dyn Fn() -> bool| execute_run(plan, run, stops);
        run_parallel(&sample, self.jobs(), &|| false, attempt, |_| Ok(()))?;
        let share = mine.len() as f64 / tried.max(1) as f64;
        stderr_line!(
            "{} {}: {}, about {} with {} at a time, estimated from {}",
            study.name,
            header.sweep,
            counted(mine.len(), "run"),
            HumanDuration(began.elapsed().mul_f64(share)),
            self.jobs(),
            counted(tried, "run")
        );
        for remark in (study.remarks)(header) {
            stderr_line!("note: {remark}");
        }
        Ok(true)
    }

    fn print(&self, plan: &Plan, run: usize) -> anyhow::Result<bool> {
        let scenario = plan.scenario(run).map_err(anyhow::Error::msg)?;
        let (file, seed) = (format!("run-{run}.toml"), plan.design.seed(run));
        let vocabulary = Registry::current().vocabulary();
        let command = match self.controllers.external(&scenario, &vocabulary)? {
            Some(external) => {
                terminal::print(&external.scenario)?;
                format!("alliance run {file} --seed {seed}{}", external.options)
            }
            None => {
                terminal::print(&scenario)?;
                repeat_command(&file, seed, plan.check)
            }
        };
        stderr_line!("to repeat the run, save this as {file}: {command}");
        Ok(true)
    }

    /// Returns the command that resumes the sweep.
    fn again(&self, study: &PlanCommand) -> String {
        let mut words = command_words(study.name, &self.paths, self.out.as_deref(), self.jobs);
        if let Some(shard) = self.shard {
            words += &format!(" --shard {shard}");
        }
        words + &self.controllers.options()
    }
}

/// Returns a command with its paths and options.
pub fn command_words(
    name: &str,
    paths: &[PathBuf],
    out: Option<&Path>,
    jobs: Option<NonZeroUsize>,
) -> String {
    let paths = paths.iter().map(|path| shell_quoted(path));
    let out = out.map(|out| format!("--out {}", shell_quoted(out)));
    let jobs = jobs.map(|jobs| format!("--jobs {jobs}"));
    let words = [format!("alliance {name}")].into_iter().chain(paths);
    words.chain(out).chain(jobs).collect::<Vec<_>>().join(" ")
}

/// Returns the number of concurrent runs: by default one per core.
pub fn jobs_or_cores(jobs: Option<NonZeroUsize>) -> NonZeroUsize {
    let jobs = jobs.or_else(|| available_parallelism().ok());
    jobs.unwrap_or(NonZeroUsize::MIN)
}

/// Returns the name of a plan: its file name without extension.
pub fn plan_name(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

pub fn read_text(file: &Path) -> anyhow::Result<String> {
    let name = file.display().to_string();
    let bytes = terminal::read_file(file)?;
    Ok(decode_text(&name, bytes)?)
}

/// Reads a plan. Files that it names are relative to its folder.
pub fn read_plan(file: &Path, text: &str, known: &Known) -> anyhow::Result<Plan> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut plan = Plan::parse(&file.display().to_string(), text, |name| {
        // Files are relative to the plan, not to the working directory.
        let source = match known.vocabulary.builtin(name) {
            Some(_) => name.to_owned(),
            None => folder.join(name).display().to_string(),
        };
        read_scenario(&source, known)
    })?;
    plan.best_known = plan.best_known.map(|best_known| folder.join(best_known));
    Ok(plan)
}

/// Prints the contradictions of a valid plan before its runs.
pub fn show_notes(notes: &[String]) {
    for note in notes.iter().take(SHOWN) {
        stderr_line!("note: {note}");
    }
}

fn known_rows(folder: &Path, header: &Header) -> anyhow::Result<RowsByRun> {
    let folders: Vec<PathBuf> = [folder.to_owned()]
        .into_iter()
        .filter(|folder| folder.exists())
        .collect();
    let Some((known, rows)) = read_all(&folders)? else {
        return Ok(RowsByRun::new());
    };
    let folder = folder.display();
    if known.version != header.version {
        bail!(
            "version {} of this program began {folder}; continue with that version, or name a new folder with --out",
            known.version
        );
    }
    if known.digest != header.digest {
        bail!(
            "{folder} holds another sweep, or this one before it was changed; name a new folder with --out, or remove that folder"
        );
    }
    Ok(rows)
}

impl Work {
    /// Opens the journal of a plan in a folder, with the runs that are done already. The text is that of the plan.
    ///
    /// # Errors
    /// Returns an error if the folder belongs to another sweep or version, or cannot be written.
    pub fn open(
        (plan, text): (Plan, &str),
        header: Header,
        folder: PathBuf,
        shard: Option<Shard>,
        sheet: Sheet,
    ) -> anyhow::Result<Self> {
        let done = known_rows(&folder, &header)?;
        make_folder(&folder)?;
        let journal = journal::open(&folder, shard, &header)?;
        write_atomically(&folder.join(PLAN), text.as_bytes())?;
        write_atomically(&folder.join(SCENARIO), plan.base().as_bytes())?;
        Ok(Self {
            plan,
            header,
            folder,
            shard,
            journal,
            done,
            sheet,
        })
    }

    /// Executes the runs. Returns `true` if all are done and none failed. `again`: the command that resumes them;
    /// `plan`: the arguments that state the plan.
    pub fn run(
        mut self,
        jobs: NonZeroUsize,
        study: &PlanCommand,
        again: &str,
        plan: &str,
    ) -> anyhow::Result<bool> {
        let interrupted = InterruptFlag::install()?;
        let all = self.plan.design.runs().unwrap_or_default();
        let mine = |run: &usize| self.shard.is_none_or(|shard| shard.contains(*run));
        let (before, runs): (Vec<usize>, Vec<usize>) = (0..all)
            .filter(mine)
            .partition(|run| self.done.contains_key(run));
        let total = before.len() + runs.len();
        let mut progress = RunProgress::new(before.len(), total);
        let known = match before.len() {
            0 => String::new(),
            known => format!(", {known} of them done before"),
        };
        let part = self
            .shard
            .map_or_else(String::new, |shard| format!(", shard {shard}"));
        progress.print_line(&format!(
            "{} {}{part}: {}{known}; {jobs} at a time",
            study.name,
            self.header.sweep,
            counted(total, "run")
        ));
        for remark in (study.remarks)(&self.header) {
            progress.print_line(&format!("note: {remark}"));
        }
        let stops = || interrupted.is_set();
        let attempt = |run, stops: &dyn Fn() -> bool| execute_run(&self.plan, run, stops);
        let worked = run_parallel(&runs, jobs, &stops, attempt, |row| {
            self.journal.add(&row)?;
            if let RunResult::Failed(failure) = &row.end {
                keep(&self.folder, &self.header, row.run, failure)?;
                progress.print_line(&format!("run {} failed: {}", row.run, failure.reason));
            }
            progress.add(matches!(row.end, RunResult::Failed(_)));
            self.done.insert(row.run, row);
            Ok(())
        });
        progress.clear();
        worked?;

        let folder = shell_quoted(&self.folder);
        let left = runs
            .iter()
            .filter(|run| !self.done.contains_key(run))
            .count();
        if left > 0 {
            stderr_line!(
                "interrupted: {left} of {} left; continue with\n  {again}",
                counted(total, "run")
            );
            return Err(Interrupted.into());
        }
        if let Some(shard) = self.shard {
            stderr_line!(
                "shard {shard}: {} done; when all shards are done, merge them with\n  alliance {} --merge {folder}",
                counted(total, "run"),
                study.name
            );
            let failed = (0..all).filter(|run| shard.contains(*run)).any(|run| {
                let row = self.done.get(&run);
                row.is_some_and(|row| matches!(row.end, RunResult::Failed(_)))
            });
            return Ok(!failed);
        }
        let look = (Some(plan), self.sheet);
        finish(&self.folder, &self.header, self.done, study, look)
    }
}

/// Writes the scenarios of failed runs, then the results. Returns `true` if no run failed.
fn finish(
    folder: &Path,
    header: &Header,
    rows: RowsByRun,
    study: &PlanCommand,
    (plan, sheet): (Option<&str>, Sheet),
) -> anyhow::Result<bool> {
    let rows: Vec<Row> = rows.into_values().collect();
    show_notes(note_of_builds(&rows).as_slice());
    for row in &rows {
        if let RunResult::Failed(failure) = &row.end {
            keep(folder, header, row.run, failure)?;
        }
    }
    (study.finish)(folder, header, &rows, plan, &sheet)
}

/// Writes the scenario of a failed run with the reason and the command that repeats it.
fn keep(folder: &Path, header: &Header, run: usize, failure: &Failure) -> anyhow::Result<()> {
    let failures = folder.join(FAILURES);
    make_folder(&failures)?;
    let name = format!("{run}.toml");
    let text = format!(
        "# run {run} failed: {}\n# {}\n{}",
        failure.reason,
        repeat_command(&name, header.design.seed(run), header.check),
        failure.scenario
    );
    write_atomically(&failures.join(&name), text.as_bytes())
}

#[must_use]
pub fn repeat_command(scenario: &str, seed: u64, check: bool) -> String {
    let check = if check { " --check" } else { "" };
    format!("alliance run {scenario} --seed {seed} --in-process{check}")
}

pub fn jobs(text: &str) -> Result<NonZeroUsize, String> {
    text.parse()
        .map_err(|_| "use a whole number from 1 on".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_is_a_plan() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("sweeps/gone-or-not.toml");
        let text = fs::read_to_string(&file).unwrap();
        let known = Known {
            vocabulary: Registry::built_in().vocabulary(),
            worlds: Registry::built_in().worlds().clone(),
        };
        let plan = read_plan(&file, &text, &known).unwrap();
        assert_eq!(plan.design.runs(), Some(3 * 2 * 2 * 5));
    }
}
