//! The files of a finding, the table of results and the result in sentences.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use in_process::Team;
use missions::Registry;
use proto::tick::Outcome;
use run_log::LogLevel;
use run_log::recorder::Folder;
use scenario::Scenario;
use scenario::fault::Order;
use scenario::time::SimTime;
use terminal::counted;

use super::case::Case;
use super::hunting::{AllocatorResult, Finding, SearchResult};
use super::plan::HuntPlan;
use super::violation::ViolationKind;
use crate::columns::{Entry, Table};
use crate::invariants::Invariants;
use crate::new_file::write_atomically;
use crate::report::command::{FigureOptions, report};
use crate::shell::shell_quoted;
use crate::sweep::execution::repeat_command;

/// A finding with the names of its files.
pub struct Shown<'r> {
    pub result: &'r AllocatorResult,
    pub search: &'r SearchResult,
    pub finding: Option<(&'r Finding, Files)>,
}

/// The names of the files of a finding, in the folder of the hunt.
pub struct Files {
    /// The scenario as it was found.
    pub found: String,
    /// The scenario with the least faults, robots and tasks.
    pub least: String,
    /// The folder with the log and the report of its run.
    pub run: String,
}

impl Files {
    fn new(result: &AllocatorResult, search: &SearchResult) -> Self {
        let name = format!("{}-{}", plain(&result.allocator), method(search));
        Self {
            found: format!("found-{name}.toml"),
            least: format!("least-{name}.toml"),
            run: format!("least-{name}"),
        }
    }
}

/// Returns a name for files.
fn plain(name: &str) -> String {
    let letters = name.chars().map(|letter| match letter {
        letter if letter.is_ascii_alphanumeric() || letter == '-' || letter == '_' => letter,
        _ => '+',
    });
    letters.collect()
}

/// Returns the name of a search.
#[must_use]
pub fn method(search: &SearchResult) -> &'static str {
    search
        .method
        .map_or("fault-free", super::plan::Method::as_str)
}

/// Returns all searches with the files of their findings.
#[must_use]
pub fn shown(results: &[AllocatorResult]) -> Vec<Shown<'_>> {
    let each = results.iter().flat_map(|result| {
        let searches = result.searches.iter();
        searches.map(move |search| Shown {
            result,
            search,
            finding: search
                .finding
                .as_ref()
                .map(|finding| (finding, Files::new(result, search))),
        })
    });
    each.collect()
}

/// Returns the least case as it is written. Its limit ends the run at the violation, if the command would not show it
/// otherwise.
fn written(finding: &Finding) -> Case {
    let mut case = finding.shrunk.case.clone();
    let ends_there = finding.kind.is_a_duration();
    if let Some(found) = finding
        .shrunk
        .judgement
        .violation
        .as_ref()
        .filter(|_| ends_there)
    {
        let mut scenario = (*case.scenario).clone();
        scenario.limit_s = found.at_ms.as_secs_f64();
        case.scenario = Arc::new(scenario);
    }
    case
}

/// Returns the command that shows the violation of a finding, for a scenario in this file.
#[must_use]
pub fn command(finding: &Finding, file: &str) -> String {
    let check = ViolationKind::INVARIANTS.contains(&finding.kind);
    repeat_command(file, finding.shrunk.case.seed, check)
}

/// Writes the scenarios of a finding, the log of the least one, and its report.
///
/// # Errors
/// Returns an error if a file cannot be written, or if the written scenario does not have the violation.
pub fn write(folder: &Path, hunt: &str, shown: &Shown<'_>) -> anyhow::Result<()> {
    let Some((finding, files)) = &shown.finding else {
        return Ok(());
    };
    let description = |judgement: &super::case::Judgement| {
        let found = judgement.violation.as_ref();
        found.map_or_else(String::new, |found| found.description.clone())
    };
    let origin = format!(
        "# {} {}: run {} of the {} search of hunt {hunt}, with {}.\n",
        shown.result.allocator,
        finding.kind,
        finding.run,
        method(shown.search),
        counted(finding.case.faults.len(), "fault")
    );
    let found = format!(
        "{origin}# {}\n# Seed {}.\n{}",
        description(&finding.judgement),
        finding.case.seed,
        finding.case.to_toml()?
    );
    write_atomically(&folder.join(&files.found), found.as_bytes())?;
    let least = written(finding);
    let shrunk = &finding.shrunk;
    let is_least = match shrunk.is_least {
        true => "no step makes it simpler",
        false => "the limit of runs came first",
    };
    let status = match finding.kind {
        ViolationKind::WorstPar2 | ViolationKind::Panic => "",
        _ => "   # exit status 1",
    };
    let text = format!(
        "{origin}# {}\n# Shrunk to {}, {} and seed {} in {}: {is_least}.\n# In this folder:\n#   {}{status}\n{}",
        description(&shrunk.judgement),
        counted(least.faults.len(), "fault"),
        counted(least.scenario.robots.len(), "robot"),
        least.seed,
        counted(shrunk.runs, "run"),
        command(finding, &files.least),
        least.to_toml()?
    );
    write_atomically(&folder.join(&files.least), text.as_bytes())?;
    if finding.kind == ViolationKind::Panic {
        // A panic leaves no log.
        return Ok(());
    }
    let vocabulary = Registry::current().vocabulary();
    let mut scenario = Scenario::parse(&files.least, &text, &vocabulary)?;
    let faults = std::mem::take(&mut scenario.faults.timeline);
    let read = Case {
        scenario: Arc::new(scenario),
        faults,
        ..least
    };
    let run = folder.join(&files.run);
    remove_run(&run)?;
    record(&read, finding, &run)
        .with_context(|| folder.join(&files.least).display().to_string())?;
    report(&run, &run.join("report"), &FigureOptions::default())?;
    Ok(())
}

/// Removes the log of an earlier start of this hunt.
fn remove_run(run: &Path) -> anyhow::Result<()> {
    if run.join("run.json").exists() {
        fs::remove_dir_all(run).with_context(|| format!("cannot remove {}", run.display()))?;
    }
    Ok(())
}

/// Runs the written scenario with a full log, up to its violation.
fn record(case: &Case, finding: &Finding, run: &Path) -> anyhow::Result<()> {
    let setup = case.setup()?;
    let is_invariant = ViolationKind::INVARIANTS.contains(&finding.kind);
    let mut invariants = is_invariant.then(|| Invariants::new(&setup));
    let mut team = Team::new(setup, LogLevel::Full, Folder::create(run)?)?;
    let mut violated = None;
    let outcome = loop {
        let outcome = team.tick()?;
        if let Some(invariants) = &mut invariants
            && let Err(found) = invariants.check_simulation(team.simulation())
            && finding.kind == found.invariant.into()
        {
            violated = Some(found);
            break outcome.unwrap_or(Outcome::Interrupted);
        }
        if let Some(outcome) = outcome {
            break outcome;
        }
    };
    team.end(outcome)?;
    let shows = match finding.kind {
        ViolationKind::Incomplete => outcome != Outcome::Complete,
        kind if kind.is_a_duration() => outcome != Outcome::Complete,
        ViolationKind::ReplayIdentical | ViolationKind::WorstPar2 | ViolationKind::Panic => true,
        _ => violated.is_some(),
    };
    if !shows {
        bail!(
            "the written scenario does not show {}; keep this folder and report it",
            finding.kind
        );
    }
    Ok(())
}

/// Returns the faults of a case as on the command line.
#[must_use]
pub fn faults_text(faults: &[Order]) -> String {
    let faults: Vec<String> = faults.iter().map(ToString::to_string).collect();
    match faults.is_empty() {
        true => "no fault".to_owned(),
        false => faults.join("; "),
    }
}

/// Returns the result of a search in one sentence.
#[must_use]
pub fn sentence(plan: &HuntPlan, shown: &Shown<'_>) -> String {
    let (search, name) = (shown.search, &shown.result.allocator);
    let head = format!("{name}, {}", method(search));
    let Some((finding, _)) = &shown.finding else {
        return format!(
            "{head}: no violation in {}, which covered {}.",
            counted(search.runs, "run"),
            counted(search.states, "state")
        );
    };
    let shrunk = &finding.shrunk;
    let limit = SimTime::from_secs_f64(finding.case.scenario.limit_s);
    let what = match plan.maximizes_par2 && finding.kind == ViolationKind::WorstPar2 {
        true => format!(
            "the worst PAR2 time of {} is {} in run {}",
            counted(search.runs, "run"),
            finding.judgement.par2(limit),
            finding.run
        ),
        false => format!("{} in run {}", finding.kind, finding.run),
    };
    format!(
        "{head}: {what}. {} became {} in {}, with {} and seed {}: {}.",
        counted(finding.case.faults.len(), "fault"),
        shrunk.case.faults.len(),
        counted(shrunk.runs, "run"),
        counted(shrunk.case.scenario.robots.len(), "robot"),
        shrunk.case.seed,
        faults_text(&shrunk.case.faults)
    )
}

/// Returns the path of the least scenario of a finding, quoted for a shell.
#[must_use]
pub fn least_path(folder: &Path, files: &Files) -> String {
    shell_quoted(&PathBuf::from(folder).join(&files.least))
}

/// Returns a row per search.
#[must_use]
pub fn table(results: &[Shown<'_>]) -> Table {
    Table::of_rows(results.iter().map(|shown| {
        let found = shown
            .finding
            .as_ref()
            .map(|(finding, files)| (*finding, files));
        let count = |of: &dyn Fn(&Finding) -> usize| match found {
            Some((finding, _)) => Entry::count(of(finding)),
            None => Entry::Whole(None),
        };
        let text =
            |of: &dyn Fn(&Finding) -> String| Entry::Text(found.map(|(finding, _)| of(finding)));
        [
            ("allocator", Entry::text(&shown.result.allocator)),
            ("search", Entry::text(method(shown.search))),
            ("runs", Entry::count(shown.search.runs)),
            ("states", Entry::count(shown.search.states)),
            (
                "worst_par2_s",
                Entry::number(shown.search.worst_par2.as_secs_f64()),
            ),
            ("violation", text(&|finding| finding.kind.to_string())),
            ("found_in_run", count(&|finding| finding.run)),
            ("faults_found", count(&|finding| finding.case.faults.len())),
            (
                "faults_least",
                count(&|finding| finding.shrunk.case.faults.len()),
            ),
            (
                "robots_least",
                count(&|finding| finding.shrunk.case.scenario.robots.len()),
            ),
            (
                "seed_least",
                count(&|finding| finding.shrunk.case.seed as usize),
            ),
            ("shrink_runs", count(&|finding| finding.shrunk.runs)),
            (
                "least",
                text(&|finding| faults_text(&finding.shrunk.case.faults)),
            ),
            (
                "file",
                Entry::Text(found.map(|(_, files)| files.least.clone())),
            ),
        ]
    }))
}
