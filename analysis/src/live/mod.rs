//! A live run for observers of other tools. The log of the run is read while it grows, and the run is repeated from it.
//!
//! Reading files has no effect on world and robots, and the log contains only ticks that are final. The repetition has
//! the values that the log leaves out, and it is compared with the log in each tick.

mod growing_file;
mod new_rows;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use in_process::Team;
use missions::Registry;
use proto::tick::Outcome;
use proto::view::View;
use run_log::{
    Document, InputLine, LogLevel, RUN_SECTION, RunFile, RunOutcome, Table, TickRow, WORLD_ROBOT,
    no_run,
};
use scenario::ids::Tick;
use scenario::{Problem, Setup};

use growing_file::GrowingFile;
pub use new_rows::{NewRows, RowSource};

/// The number of ticks after which [`LiveRun::advance`] returns, so that its caller can end.
const TICKS_AT_ONCE: u64 = 256;

/// An observer of a live run.
pub trait Follower {
    /// Takes the state at the time at which a tick begins, when the tick is over. `rows` are those that the tick has written;
    /// the poses among them belong to the view.
    ///
    /// # Errors
    /// Returns the errors of the observer.
    fn tick(&mut self, view: &View, rows: &NewRows) -> anyhow::Result<()>;

    /// Takes the state at the end of the run, and the rows that the end has written.
    ///
    /// # Errors
    /// Returns the errors of the observer.
    fn finish(&mut self, end: &View, rows: &NewRows) -> anyhow::Result<()>;
}

/// The progress of a live run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The log has more ticks.
    More,
    /// All ticks of the log are done, and the run continues.
    UpToDate,
    /// The run is over, and the follower has taken all of it.
    Over,
}

/// Checks that a run can be followed while it is live. Errors name the command-line `option`.
///
/// # Errors
/// Returns an error if the log will not have a hash for every tick, or if robots have external controllers, whose answers
/// the follower does not read.
pub fn check(setup: &Setup, log: LogLevel, option: &str) -> Result<(), Problem> {
    let problem = |what: String, remedy| Err(Problem::with_source(option, what, remedy));
    if !log.has_every_tick() {
        let what = format!(
            "the log is '{}', and observers need one of every tick",
            log.as_str()
        );
        return problem(what, "add --log compact");
    }
    let external = setup.scenario.external_controllers();
    if let Some(name) = external.first() {
        let what = format!("the controller '{name}' is an external program");
        return problem(what, "export the run afterwards");
    }
    Ok(())
}

/// A live run, as far as its log has been read.
pub struct LiveRun {
    run_json: PathBuf,
    /// The text of run.json when it was read last.
    text: Vec<u8>,
    run: RunFile,
    ticks: GrowingFile,
    inputs: GrowingFile,
    /// The complete ticks that have not been repeated, each with its hash.
    complete: VecDeque<(Tick, u64)>,
    /// Inputs from before the repetition begins.
    early: Vec<InputLine>,
    repetition: Option<Repetition>,
}

impl LiveRun {
    /// Opens the folder of a run. Errors of [`check`] name the command-line `option`.
    ///
    /// # Errors
    /// Returns an error if the folder contains no run, and the errors of [`check`].
    pub fn open(folder: &Path, option: &str) -> anyhow::Result<Self> {
        let file = |table: Table| GrowingFile::new(folder.join(table.file_name()));
        let run_json = folder.join(Document::Run.file_name());
        let text = fs::read(&run_json).map_err(|error| no_run(folder, &run_json, error))?;
        let run = parse(&text, &run_json)?;
        check(&run.setup, run.log, option)?;
        Ok(Self {
            ticks: file(Table::Ticks),
            inputs: file(Table::Inputs),
            run_json,
            text,
            run,
            complete: VecDeque::new(),
            early: Vec::new(),
            repetition: None,
        })
    }

    /// Returns the setup of the run.
    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.run.setup
    }

    /// Returns whether the run had ended when its log was read last.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.run.outcome != RunOutcome::Running
    }

    /// Reads whether the run has ended.
    ///
    /// # Errors
    /// Returns an error if run.json cannot be read.
    pub fn read_outcome(&mut self) -> anyhow::Result<()> {
        let path = &self.run_json;
        let text = fs::read(path).with_context(|| path.display().to_string())?;
        if text != self.text {
            self.run = parse(&text, path)?;
            self.text = text;
        }
        Ok(())
    }

    /// Reads the new part of the log, and shows the follower the ticks that are final. A tick is repeated when the next
    /// one is complete, because robots that join then are inputs of the next one.
    ///
    /// # Errors
    /// Returns an error if the log cannot be read, or if this program does not repeat the run exactly. Returns the errors
    /// of the follower.
    pub fn advance(&mut self, follower: &mut dyn Follower) -> anyhow::Result<Progress> {
        self.read_log()?;
        if self.repetition.is_none() && !self.complete.is_empty() {
            let early = std::mem::take(&mut self.early);
            self.repetition = Some(Repetition::new(&self.run.setup, early)?);
        }
        let Some(repetition) = &mut self.repetition else {
            // A run can end before its first tick.
            return Ok(if self.has_ended() {
                Progress::Over
            } else {
                Progress::UpToDate
            });
        };
        let spare = usize::from(self.run.outcome == RunOutcome::Running);
        for _ in 0..TICKS_AT_ONCE {
            if self.complete.len() <= spare {
                break;
            }
            if let Some((tick, hash)) = self.complete.pop_front() {
                repetition.tick(tick, hash, follower)?;
            }
        }
        if self.complete.len() > spare {
            return Ok(Progress::More);
        }
        let RunOutcome::Ended(outcome) = self.run.outcome else {
            return Ok(Progress::UpToDate);
        };
        if let Some(repetition) = self.repetition.take() {
            repetition.finish(self.run.result.ticks, outcome, follower)?;
        }
        Ok(Progress::Over)
    }

    /// Reads the new part of the log. The order is the opposite of that in which it is written, so that a tick in ticks.csv
    /// has all its inputs, and a run that is over all its ticks.
    fn read_log(&mut self) -> anyhow::Result<()> {
        self.read_outcome()?;
        for row in tick_rows(&self.ticks.new_lines()?)? {
            let is_seal = row.robot == WORLD_ROBOT && row.section == RUN_SECTION;
            let next = match (&self.repetition, self.complete.back()) {
                (_, Some((tick, _))) => tick + 1,
                (Some(repetition), None) => repetition.team.simulation().tick(),
                (None, None) => 0,
            };
            // The last tick of a run can be sealed again.
            if is_seal && row.tick >= next {
                self.complete.push_back((row.tick, row.hash.0));
            }
        }
        let lines = self.inputs.new_lines()?;
        let lines = lines
            .split(|byte| *byte == b'\n')
            .filter(|line| !line.is_empty());
        let inputs: Vec<InputLine> = lines
            .map(serde_json::from_slice)
            .collect::<Result<_, _>>()
            .with_context(|| self.inputs.path().display().to_string())?;
        match &mut self.repetition {
            Some(repetition) => repetition.team.add_inputs(inputs),
            None => self.early.extend(inputs),
        }
        Ok(())
    }
}

/// Reads rows of ticks.csv, with or without its header.
fn tick_rows(lines: &[u8]) -> Result<Vec<TickRow>, csv::Error> {
    let header = Table::Ticks.header().unwrap_or_default().as_bytes();
    let lines = lines.strip_prefix(header).unwrap_or(lines);
    let text = [header, lines].concat();
    let rows = csv::Reader::from_reader(text.as_slice());
    rows.into_deserialize().collect()
}

fn parse(text: &[u8], path: &Path) -> anyhow::Result<RunFile> {
    let vocabulary = Registry::current().vocabulary();
    RunFile::parse(text, &vocabulary)
        .map_err(anyhow::Error::msg)
        .with_context(|| path.display().to_string())
}

/// The run, repeated in this process.
struct Repetition {
    team: Team<NewRows>,
    rows: NewRows,
    /// The view at the start of the current tick. Its poses are in the rows of that tick.
    view: View,
}

impl Repetition {
    /// Creates the repetition at the start of the run.
    fn new(setup: &Setup, inputs: Vec<InputLine>) -> anyhow::Result<Self> {
        let rows = NewRows::default();
        let team = Team::with_inputs(setup.clone(), inputs, LogLevel::Full, rows.clone())?;
        Ok(Self {
            view: team.view(),
            team,
            rows,
        })
    }

    /// Repeats a tick, and shows the time at which it begins.
    fn tick(&mut self, tick: Tick, hash: u64, follower: &mut dyn Follower) -> anyhow::Result<()> {
        self.team.tick()?;
        self.team.unfinished()?;
        if self.team.hash() != format!("{hash:016x}") {
            bail!(
                "this program does not repeat tick {tick} of the run exactly; use the build that made the run"
            );
        }
        follower.tick(&self.view, &self.rows)?;
        self.rows.clear();
        self.view = self.team.view();
        Ok(())
    }

    /// Ends the repetition after the last tick, and shows the rest.
    fn finish(
        mut self,
        ticks: u64,
        outcome: Outcome,
        follower: &mut dyn Follower,
    ) -> anyhow::Result<()> {
        let outcome = self.team.continue_for(ticks, outcome, |_| {})?;
        self.team.unfinished()?;
        follower.tick(&self.view, &self.rows)?;
        self.rows.clear();
        let end = self.team.view();
        self.team.end(outcome)?;
        follower.finish(&end, &self.rows)
    }
}
