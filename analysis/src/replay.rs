//! Replay of a run from its log. The same scenario, seed and inputs give the same bytes.

use missions::Registry;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::Args;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog, RunLog, RunOutcome};
use terminal::stderr_line;
use world_server::simulation::Simulation;

use crate::diff::{Comparison, Difference, compare};
use in_process::{AnswerError, AnswerSource, LoggedAnswers, Team, TickError};

/// Run a logged run again and compare every tick.
#[derive(Args, Clone, Debug)]
pub struct ReplayCommand {
    /// Folder of the run
    folder: PathBuf,
    /// Write the log of the replay into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also run this external controller again and compare its answers with the log
    #[arg(long = "mind", value_name = "NAME=COMMAND")]
    controllers: Vec<String>,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
}

/// A function that runs external controllers beside their logged answers. Its strings are the values of `--mind`.
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
    pub fn run(&self, ask_minds: RunControllers) -> ExitCode {
        match self.replay(ask_minds) {
            Ok(comparison) => comparison.show(self.json),
            Err(error) => {
                if let Some(TickError::Foreign(AnswerError::Other(why))) = error.downcast_ref()
                    && let Some(AnswerDifference(found)) = why.downcast_ref()
                {
                    return Comparison::Differs(found.clone()).show(self.json);
                }
                stderr_line!("alliance replay: {error:#}");
                ExitCode::from(2)
            }
        }
    }

    fn replay(&self, ask_minds: RunControllers) -> anyhow::Result<Comparison> {
        if let Some(out) = &self.out
            && out.join("run.json").exists()
        {
            bail!(
                "--out {}: already holds a run; name a new folder",
                out.display()
            );
        }
        let logged = RunLog::open(&self.folder, &Registry::current().vocabulary())?;
        let version = env!("CARGO_PKG_VERSION");
        if logged.run.version != version {
            stderr_line!(
                "the run was recorded by version {}; this is version {version}",
                logged.run.version
            );
        }
        let foreign: Option<Box<dyn AnswerSource>> = match LoggedAnswers::of(&logged)? {
            Some(kept) if !self.controllers.is_empty() => {
                Some(ask_minds(&logged, &self.controllers, kept)?)
            }
            Some(kept) => Some(Box::new(kept)),
            None if !self.controllers.is_empty() => {
                bail!("--mind: this run has no external controllers; leave the option out")
            }
            None => None,
        };
        let (team, outcome) = team_to_end(&logged, logged.run.log, foreign, |_| {})?;
        let (memory, again) = log_of(team, outcome)?;
        if let Some(out) = &self.out {
            write(&memory, out)?;
        }
        Ok(compare(&logged, &again)?)
    }
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
    let (team, outcome) = team_at_end(logged, level, see)?;
    log_of(team, outcome)
}

fn log_of(team: Team<MemoryLog>, outcome: Outcome) -> anyhow::Result<(MemoryLog, RunLog)> {
    let (_, recorder) = team.end(outcome)?;
    let memory = recorder.into_sink();
    let vocabulary = Registry::current().vocabulary();
    let again = RunLog::from_memory(&memory, &vocabulary).context("the log of the replay")?;
    Ok((memory, again))
}

/// Returns the team of a replayed run at its end, and the outcome; see [`replay()`].
pub(crate) fn team_at_end(
    logged: &RunLog,
    level: LogLevel,
    see: impl FnMut(&mut Simulation),
) -> anyhow::Result<(Team<MemoryLog>, Outcome)> {
    let kept = LoggedAnswers::of(logged)?.map(|kept| Box::new(kept) as Box<dyn AnswerSource>);
    team_to_end(logged, level, kept, see)
}

fn team_to_end(
    logged: &RunLog,
    level: LogLevel,
    foreign: Option<Box<dyn AnswerSource>>,
    see: impl FnMut(&mut Simulation),
) -> anyhow::Result<(Team<MemoryLog>, Outcome)> {
    let (ticks, outcome) = match (logged.run.outcome, logged.last) {
        (RunOutcome::Ended(outcome), _) => (logged.run.result.ticks, outcome),
        (RunOutcome::Running, Some(last)) => (last.tick + 1, Outcome::Interrupted),
        (RunOutcome::Running, None) if logged.run.log == LogLevel::Off => {
            bail!("the run did not end and was logged with --log off: there is nothing to compare")
        }
        (RunOutcome::Running, None) => bail!("the log has no complete tick"),
    };
    let setup = logged.run.setup.clone();
    let scenario = &setup.scenario;
    let registry = Registry::current();
    if let Err(error) = registry.worlds().find(scenario)?.start_poses(scenario) {
        bail!("run.json: scenario.{}", error.describe(scenario));
    }
    let inputs = logged.inputs()?;
    let mut team = Team::with_answer_source(setup, inputs, level, MemoryLog::default(), foreign)?;
    let outcome = team.continue_for(ticks, outcome, see)?;
    Ok((team, outcome))
}

fn write(memory: &MemoryLog, out: &Path) -> anyhow::Result<()> {
    let at = || out.display().to_string();
    std::fs::create_dir_all(out).with_context(at)?;
    for (table, bytes) in &memory.tables {
        std::fs::write(out.join(table.file_name()), bytes).with_context(at)?;
    }
    for (document, text) in &memory.documents {
        std::fs::write(out.join(document.file_name()), text).with_context(at)?;
    }
    Ok(())
}
