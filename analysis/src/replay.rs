//! Replay of a run from its log. The same scenario, seed and inputs give the same bytes.

use missions::Registry;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::Args;
use proto::program_build;
use proto::tick::Outcome;
use run_log::recorder::Sink;
use run_log::{Input, LogLevel, MemoryLog, RunFile, RunLog, RunOutcome};
use scenario::time::SimTime;
use scenario::{Problem, Setup};
use terminal::stderr_line;
use world_server::simulation::Simulation;

use crate::diff::{Comparison, Difference, compare_files, compare_parts};
use crate::new_file::write_atomically;
use crate::progress::Progress;
use crate::{LATEST, exit_status, open};
use in_process::{AnswerError, AnswerSource, LoggedAnswers, Team, TickError};

/// Replay a logged run and compare every tick
#[derive(Args, Clone, Debug)]
pub struct ReplayCommand {
    /// Folder of the run
    #[arg(value_name = "RUN", default_value = LATEST)]
    folder: PathBuf,
    /// Write the log of the replay into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run this external controller again, and compare its answers; repeatable
    #[arg(long = "controller", value_name = "NAME=COMMAND")]
    controllers: Vec<String>,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
}

/// A function that runs external controllers beside their logged answers. Its strings are the values of `--controller`.
pub type RunControllers =
    fn(&RunLog, &[String], LoggedAnswers) -> anyhow::Result<Box<dyn AnswerSource>>;

/// A difference between the answer of an external controller and the log.
#[derive(Debug, thiserror::Error)]
#[error("{robot} answers differently from the log", robot = .0.robot)]
pub struct AnswerDifference(pub Difference);

impl ReplayCommand {
    /// Replays the run. Returns exit status 0 if the replay is identical, 1 if it differs, and 2 if the folder contains
    /// no replayable run.
    #[must_use]
    pub fn run(&self, run_controllers: RunControllers) -> ExitCode {
        let compared = self.replay(run_controllers).or_else(|error| {
            if let Some(TickError::Foreign(AnswerError::Other(why))) = error.downcast_ref()
                && let Some(AnswerDifference(found)) = why.downcast_ref()
            {
                return Ok(Comparison::Differs(found.clone()));
            }
            Err(error)
        });
        exit_status("replay", compared.map(|found| found.show(self.json)), 2)
    }

    fn replay(&self, run_controllers: RunControllers) -> anyhow::Result<Comparison> {
        if let Some(out) = &self.out
            && out.join("run.json").exists()
        {
            let option = format!("--out {}", out.display());
            bail!(Problem::with_source(
                option,
                "already holds a run",
                "name a new folder"
            ));
        }
        let logged = open(&self.folder)?;
        tell_other_programs(&logged.run);
        if logged.run.outcome == RunOutcome::Running {
            stderr_line!("the run has not ended; the replay covers the ticks in its log so far");
        }
        if let Some(difference) = false_origin(&logged)? {
            return Ok(Comparison::Differs(difference));
        }
        let answer_source: Option<Box<dyn AnswerSource>> = match LoggedAnswers::of(&logged)? {
            Some(kept) if !self.controllers.is_empty() => {
                Some(run_controllers(&logged, &self.controllers, kept)?)
            }
            Some(kept) => Some(Box::new(kept)),
            None if !self.controllers.is_empty() => {
                let problem = "this run has no external controllers";
                bail!(Problem::with_source(
                    "--controller",
                    problem,
                    "leave the option out"
                ))
            }
            None => None,
        };
        let memory = MemoryLog::default();
        let (mut team, outcome) =
            team_to_end(&logged, logged.run.log, answer_source, memory, |_| {})?;
        let in_progress = match logged.run.outcome {
            RunOutcome::Running => Some(log_in_progress(&mut team)?),
            RunOutcome::Ended(_) => None,
        };
        let (memory, again) = log_of(team, outcome)?;
        if let Some(out) = &self.out {
            write(&memory, out)?;
        }
        if let Some(in_progress) = in_progress {
            let comparison = compare_files(&logged, &in_progress)?;
            if matches!(comparison, Comparison::Identical { .. }) {
                return Ok(comparison);
            }
            // The world can be killed after the last rows and before the last run.json.
            return Ok(match compare_parts(&logged, &again, &in_progress)? {
                Comparison::Differs(_) => comparison,
                identical => identical,
            });
        }
        Ok(compare_files(&logged, &again)?)
    }
}

/// Compares the origin of a branch in run.json with the inputs. Nothing in the log shows the run that it names.
fn false_origin(logged: &RunLog) -> anyhow::Result<Option<Difference>> {
    let inputs = logged.inputs()?;
    let branched = inputs
        .iter()
        .filter(|line| matches!(line.input, Input::Branch(_)));
    let latest = branched.map(|line| line.tick).max();
    let differs = |field: &str, found: String, wanted: String| {
        let field = Some(format!("branch{field}"));
        Some(Difference::at_end("run.json", field, found, wanted))
    };
    let Some(origin) = &logged.run.branch else {
        return Ok(
            latest.and_then(|tick| differs("", "none".into(), format!("a branch of tick {tick}")))
        );
    };
    let t_ms = origin.tick * logged.run.setup.scenario.step_ms;
    Ok(if origin.t_ms != SimTime(t_ms) {
        differs(".t_ms", origin.t_ms.0.to_string(), t_ms.to_string())
    } else if latest.is_some_and(|tick| tick > origin.tick) {
        let latest = latest.unwrap_or_default();
        differs(
            ".tick",
            origin.tick.to_string(),
            format!("{latest} or later"),
        )
    } else {
        None
    })
}

/// Names the version and the builds that took part in a run and are not those of this program.
pub(crate) fn tell_other_programs(run: &RunFile) {
    let version = env!("CARGO_PKG_VERSION");
    if run.version != version {
        let recorded = &run.version;
        stderr_line!("the run was recorded by version {recorded}; this is version {version}");
    }
    let this = program_build::get();
    if program_build::is_other(&run.build) {
        stderr_line!(
            "the run was recorded by build {}; this is build {this}",
            run.build
        );
    }
    for (robot, build) in &run.agent_builds {
        if program_build::is_other(build) {
            stderr_line!("the agent of {robot} was of build {build}; this is build {this}");
        }
    }
}

/// Returns the setup of a logged run after a check of the robots' starts, which reading run.json does not check.
pub(crate) fn setup_of(logged: &RunLog) -> anyhow::Result<Setup> {
    let setup = logged.run.setup.clone();
    let scenario = &setup.scenario;
    let worlds = Registry::current().worlds();
    if let Err(error) = worlds.find(scenario)?.start_poses(scenario) {
        bail!("run.json: scenario.{}", error.describe(scenario));
    }
    Ok(setup)
}

fn log_in_progress(team: &mut Team<MemoryLog>) -> anyhow::Result<RunLog> {
    let memory = team.unfinished()?;
    RunLog::from_memory(memory, &Registry::current().vocabulary()).context("the log of the replay")
}

/// Replays a logged run up to its last complete tick and logs it at `level`. `see` is called before the first tick and
/// after each tick.
///
/// # Errors
/// Returns an error when the log has no complete tick or contains an invalid input.
pub fn replay(
    logged: &RunLog,
    level: LogLevel,
    see: impl FnMut(&mut Simulation),
) -> anyhow::Result<(MemoryLog, RunLog)> {
    let (team, outcome) = team_at_end(logged, level, MemoryLog::default(), see)?;
    log_of(team, outcome)
}

fn log_of(team: Team<MemoryLog>, outcome: Outcome) -> anyhow::Result<(MemoryLog, RunLog)> {
    let (_, recorder) = team.end(outcome)?;
    let memory = recorder.into_sink();
    let vocabulary = Registry::current().vocabulary();
    let again = RunLog::from_memory(&memory, &vocabulary).context("the log of the replay")?;
    Ok((memory, again))
}

/// Returns the team of a replayed run at its end, and the outcome. The log goes to `sink`; see [`replay()`].
pub(crate) fn team_at_end<S: Sink>(
    logged: &RunLog,
    level: LogLevel,
    sink: S,
    see: impl FnMut(&mut Simulation),
) -> anyhow::Result<(Team<S>, Outcome)> {
    let kept = LoggedAnswers::of(logged)?.map(|kept| Box::new(kept) as Box<dyn AnswerSource>);
    team_to_end(logged, level, kept, sink, see)
}

/// Returns the number of ticks of a logged run up to its last complete one, and the outcome.
pub(crate) fn end_of(logged: &RunLog) -> anyhow::Result<(u64, Outcome)> {
    match (logged.run.outcome, logged.last) {
        (RunOutcome::Ended(outcome), _) => Ok((logged.run.result.ticks, outcome)),
        (RunOutcome::Running, Some(last)) => Ok((last.tick + 1, Outcome::Interrupted)),
        (RunOutcome::Running, None) if logged.run.log == LogLevel::Off => {
            bail!("the run did not end and was logged with --log off: there is nothing to compare")
        }
        (RunOutcome::Running, None) => bail!("the log has no complete tick"),
    }
}

fn team_to_end<S: Sink>(
    logged: &RunLog,
    level: LogLevel,
    answer_source: Option<Box<dyn AnswerSource>>,
    sink: S,
    mut see: impl FnMut(&mut Simulation),
) -> anyhow::Result<(Team<S>, Outcome)> {
    let (ticks, outcome) = end_of(logged)?;
    let setup = setup_of(logged)?;
    let inputs = logged.inputs()?;
    let what = match logged.run.log {
        LogLevel::Full | LogLevel::Compact => "replaying the run",
        LogLevel::Summary => "the log is a summary: running it again",
        LogLevel::Off => "the run has no tables: running it again",
    };
    let mut progress = Progress::new(what, "ticks", ticks);
    let mut team = Team::with_answer_source(setup, inputs, level, sink, answer_source)?;
    if let Some(origin) = &logged.run.branch {
        team.set_origin(origin.clone())?;
    }
    let outcome = team.continue_for(ticks, outcome, |simulation| {
        progress.step();
        see(simulation);
    })?;
    Ok((team, outcome))
}

fn write(memory: &MemoryLog, out: &Path) -> anyhow::Result<()> {
    let at = || out.display().to_string();
    std::fs::create_dir_all(out).with_context(at)?;
    for (table, bytes) in &memory.tables {
        write_atomically(&out.join(table.file_name()), bytes)?;
    }
    for (document, text) in &memory.documents {
        write_atomically(&out.join(document.file_name()), text.as_bytes())?;
    }
    Ok(())
}
