//! A branch of a recorded run. It repeats the inputs of the run up to a tick, then goes on with other faults or
//! parameters, or with the rest of the inputs.
//!
//! The repetition is that of a replay. A branch by processes repeats the ticks in its world and in each agent, which then
//! continue as a team. So no process has to be killed or stopped again at a tick of the past.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use in_process::{AgentSnapshot, AnswerSource, LoggedAnswers, Team};
use missions::Registry;
use proto::tick::Outcome;
use run_log::recorder::Sink;
use run_log::{
    Branch, BranchOrigin, Input, InputLine, LogLevel, RUN_SECTION, RunLog, RunOutcome, TickRow,
    WORLD_ROBOT,
};
use scenario::fault::{Faults, Order};
use scenario::ids::Tick;
use scenario::limits::TIME_OR_ZERO;
use scenario::time::{SimTime, seconds};
use scenario::{KeyPath, Problem, Scenario, Setup, TomlFile, Vocabulary, decode_text};
use serde::{Deserialize, Serialize};
use world_server::faults::in_vain::in_vain;
use world_server::simulation::Simulation;

use crate::open;
use crate::progress::Progress;
use crate::replay::{setup_of, tell_other_programs};
use crate::shell::shell_quoted;

/// The options of a branch.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Branch")]
pub struct BranchArgs {
    /// Repeat this finished run up to --at, then go on from there
    #[arg(long, value_name = "RUN", requires = "at", conflicts_with_all = ["scenario", "seed"])]
    pub from: Option<PathBuf>,
    /// Simulated time of the branch, such as 60s or 2min
    #[arg(long, value_name = "TIME", requires = "from", value_parser = branch_time, allow_hyphen_values = true)]
    at: Option<f64>,
    /// Timeline after --at in place of all faults and events of the run: a TOML file, or 'none'
    #[arg(long, value_name = "FILE|none", requires = "from")]
    faults: Option<String>,
    /// Allocator parameter after --at, such as gold.fast_impatience=2; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "from", value_parser = parameter)]
    parameters: Vec<(String, f64)>,
}

/// Parses the time of a branch and returns it in seconds.
fn branch_time(text: &str) -> Result<f64, Problem> {
    let is_negative = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit());
    if text.strip_prefix('-').is_some_and(is_negative) {
        let what = format!("'{text}' is before the start of the run");
        return Err(Problem::of_value(what, "use 0 or a later time"));
    }
    let at_s = seconds(text)?;
    TIME_OR_ZERO.check((), at_s).map(|()| at_s)
}

/// Parses a parameter and its new value, `KEY=VALUE`.
fn parameter(text: &str) -> Result<(String, f64), Problem> {
    let parts = text.split_once('=');
    let parsed = parts.and_then(|(key, value)| Some((key.to_owned(), value.trim().parse().ok()?)));
    parsed.ok_or_else(|| Problem::of_value("use KEY=NUMBER, such as gold.fast_impatience=2", ""))
}

/// A checked request for a branch. The processes of the branch receive it as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BranchRequest {
    run: PathBuf,
    tick: Tick,
    changes: Branch,
    log: LogLevel,
}

/// A branch that is ready to be repeated.
pub struct BranchPlan {
    request: BranchRequest,
    logged: RunLog,
    origin: BranchOrigin,
    /// The inputs of the run that are repeated.
    inputs: Vec<InputLine>,
}

/// The state of a repeated run at which processes take over.
pub struct HandOver {
    /// The robots that take part.
    pub robots: BTreeSet<String>,
    pub tick: Tick,
}

impl BranchArgs {
    /// Reads and checks the run and the changes. Returns `None` without `--from`. `log` is the requested log level.
    ///
    /// # Errors
    /// Returns one line with the problem and the remedy.
    pub fn plan(&self, log: Option<LogLevel>) -> anyhow::Result<Option<BranchPlan>> {
        let (Some(folder), Some(at_s)) = (&self.from, self.at) else {
            // With a scenario or a seed, which exclude --from, clap does not require it.
            if self.at.is_some() || self.faults.is_some() || !self.parameters.is_empty() {
                bail!(
                    "--at, --faults and --set need a run; give --from RUN, without a scenario and a seed"
                );
            }
            return Ok(None);
        };
        let folder = &without_link(folder);
        let logged = open(folder)?;
        let step = logged.run.setup.scenario.step_ms;
        let tick = SimTime::from_secs_f64(at_s).0.div_ceil(step);
        check_log(folder, &logged)?;
        check_tick(&logged, tick, at_s)?;
        tell_other_programs(&logged.run);
        let setup = &logged.run.setup;
        let faults = match self.faults.as_deref() {
            None => None,
            Some("none") => Some(Vec::new()),
            Some(file) => Some(read_faults(file, setup, tick)?),
        };
        let changes = Branch {
            faults,
            parameters: self.parameters.iter().cloned().collect(),
        };
        let changed = setup.with_parameters(&changes.parameters);
        changed
            .and_then(|changed| changed.scenario.check_allocators(&vocabulary().allocators))
            .context("--set")?;
        if let Some(controller) = setup.scenario.external_controllers().first()
            && !changes.is_empty()
        {
            let what = format!(
                "the controller '{controller}' is an external program, whose state at {} is not in the log",
                SimTime(tick * step)
            );
            let remedy = "leave --faults and --set out, or start the mission anew";
            bail!(Problem::with_source("--from", what, remedy));
        }
        let request = BranchRequest {
            run: folder.clone(),
            tick,
            changes,
            log: log.unwrap_or(logged.run.log),
        };
        BranchPlan::new(request, logged).map(Some)
    }
}

/// Returns the folder that a link points to. A new run changes the link `runs/latest`.
fn without_link(folder: &Path) -> PathBuf {
    match std::fs::read_link(folder) {
        Ok(target) => folder.parent().unwrap_or(Path::new("")).join(target),
        Err(_) => folder.to_owned(),
    }
}

/// Checks that the log contains all inputs of a run that has ended.
fn check_log(folder: &Path, logged: &RunLog) -> anyhow::Result<()> {
    let source = folder.display().to_string();
    if logged.run.outcome == RunOutcome::Running {
        let what = "the run is in progress, or its world was killed";
        bail!(Problem::with_source(
            source,
            what,
            "branch from a run that has ended"
        ));
    }
    let (recorded, this) = (&logged.run.version, env!("CARGO_PKG_VERSION"));
    if recorded != this {
        let what = format!("the run was recorded by version {recorded}; this is version {this}");
        let remedy = format!("branch with version {recorded}, or run its scenario again");
        bail!(Problem::with_source(source, what, remedy));
    }
    if let Some(damage) = logged.damage() {
        let remedy = "branch from a complete log";
        bail!(Problem::with_source(source, damage.to_string(), remedy));
    }
    Ok(())
}

/// Checks that the run reaches the tick. An interrupted run can go on after its last tick.
fn check_tick(logged: &RunLog, tick: Tick, at_s: f64) -> anyhow::Result<()> {
    let run = &logged.run;
    let is_interrupted = run.outcome == RunOutcome::Ended(Outcome::Interrupted);
    if tick < run.result.ticks || (is_interrupted && tick == run.result.ticks) {
        return Ok(());
    }
    let end = run.result.sim_time_ms;
    let what = format!("the run ended at {end}");
    bail!(Problem::with_source(
        format!("--at {at_s}s"),
        what,
        "use an earlier time"
    ))
}

/// A file of `--faults`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FaultsFile {
    #[serde(default)]
    faults: Faults,
}

/// Reads the timeline of a file. Its times are those of the run, and none is before the branch.
fn read_faults(name: &str, setup: &Setup, tick: Tick) -> anyhow::Result<Vec<Order>> {
    let path = Path::new(name);
    let bytes = terminal::read_file(path).context("--faults")?;
    let text = decode_text(name, bytes)?;
    let file = TomlFile::parse(name, &text)?;
    let FaultsFile { faults } = file.deserialize()?;
    if faults.random.is_some() {
        let remedy = "state each fault in [[faults.timeline]]";
        bail!(file.error_at(
            ["faults", "random"],
            "a branch has no random faults",
            remedy
        ));
    }
    let step = setup.scenario.step_ms;
    let mut ids = BTreeSet::new();
    for (index, order) in faults.timeline.iter().enumerate() {
        let at = KeyPath::new(["faults", "timeline"]).index(index);
        let checked = order.check(&setup.scenario, &setup.catalog);
        checked.map_err(|problem| file.locate(problem.under(&at)))?;
        if let Some(due) = order.at()
            && due.0.div_ceil(step) < tick
        {
            let what = format!("{due} is before the branch at {}", SimTime(tick * step));
            let remedy = "use a later time, or branch earlier";
            bail!(file.error_at(at.key("at_s"), what, remedy));
        }
        if let Some(id) = &order.id
            && !ids.insert(id)
        {
            let what = format!("'{id}' is already the id of another fault of the file");
            bail!(file.error_at(at.key("id"), what, "give each its own id"));
        }
    }
    let scenario = Scenario {
        faults,
        ..setup.scenario.clone()
    };
    match in_vain(&scenario).into_iter().next() {
        Some(problem) => bail!(file.locate(problem)),
        None => Ok(scenario.faults.timeline),
    }
}

impl BranchRequest {
    /// Returns the request as JSON in one line.
    ///
    /// # Errors
    /// If the path is not UTF-8.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }

    /// Reads the JSON of [`BranchRequest::to_json`].
    ///
    /// # Errors
    /// If the text is no request.
    pub fn from_json(text: &str) -> serde_json::Result<Self> {
        serde_json::from_str(text)
    }

    /// Opens the run again in a process of the branch.
    ///
    /// # Errors
    /// If the run cannot be read.
    pub fn open(self) -> anyhow::Result<BranchPlan> {
        let logged = open(&self.run)?;
        BranchPlan::new(self, logged)
    }
}

impl BranchPlan {
    fn new(mut request: BranchRequest, logged: RunLog) -> anyhow::Result<Self> {
        let tick = request.tick;
        let origin = BranchOrigin {
            run: request.run.display().to_string(),
            hash: logged.run.hash.clone().unwrap_or_default(),
            tick,
            t_ms: SimTime(tick * logged.run.setup.scenario.step_ms),
        };
        let mut inputs = logged.inputs()?;
        if !request.changes.is_empty() {
            merge_earlier_branch(&mut request.changes, &mut inputs, tick);
            // Other faults cause other inputs.
            inputs.retain(|line| line.tick < tick || !line.input.is_scripted());
        }
        if request.changes.faults.is_some() {
            inputs.retain(|line| line.tick < tick || (tick == 0 && is_start(line)));
        }
        Ok(Self {
            request,
            logged,
            origin,
            inputs,
        })
    }

    #[must_use]
    pub fn request(&self) -> &BranchRequest {
        &self.request
    }

    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.logged.run.setup
    }

    #[must_use]
    pub fn log(&self) -> LogLevel {
        self.request.log
    }

    #[must_use]
    pub fn origin(&self) -> &BranchOrigin {
        &self.origin
    }

    /// Returns whether a robot has an external controller. Its logged answers are available in one process only.
    #[must_use]
    pub fn needs_one_process(&self) -> bool {
        !self.setup().scenario.external_controllers().is_empty()
    }

    /// Returns the tick at which processes take over: the tick of the branch, or the first tick after all repeated inputs.
    #[must_use]
    pub fn hand_over_tick(&self) -> Tick {
        let outside = self.inputs.iter().filter(|line| !line.input.is_scripted());
        let last = outside.map(|line| line.tick + 1).max().unwrap_or(0);
        self.request.tick.max(last)
    }

    /// Repeats the run up to its hand-over without a log, compares every sealed tick with the log of the run, and applies the
    /// changes. So a branch that cannot run is refused before any process starts.
    ///
    /// # Errors
    /// If this program repeats the run differently, or the state refuses a change.
    pub fn rehearse(&self) -> anyhow::Result<HandOver> {
        let mut progress = Progress::new("repeating the run", "ticks", self.hand_over_tick());
        let sink = run_log::MemoryLog::default();
        let team = self.team(LogLevel::Off, sink)?;
        let seals = self.seals()?;
        let team = self.repeat(team, self.hand_over_tick(), |team| {
            progress.step();
            let simulation = team.simulation();
            let tick = simulation.tick();
            let sealed = tick.checked_sub(1).and_then(|ended| seals.get(&ended));
            if tick <= self.request.tick && sealed.is_some_and(|hash| *hash != team.hash()) {
                bail!(self.differs(tick - 1));
            }
            Ok(())
        })?;
        let simulation = team.simulation();
        let barrier = simulation.barrier();
        let takes_part = barrier.robots().filter(|robot| {
            simulation.outcome().is_none() && barrier.incarnation(*robot).is_some()
        });
        let roster = &simulation.setup().roster;
        Ok(HandOver {
            robots: takes_part
                .map(|robot| roster.name(robot).to_owned())
                .collect(),
            tick: simulation.tick(),
        })
    }

    fn differs(&self, tick: Tick) -> Problem {
        let run = self.request.run.display();
        let what = format!("this program repeats the run differently in tick {tick}");
        let remedy = format!(
            "`alliance replay {}` shows the difference",
            shell_quoted(&self.request.run)
        );
        Problem::with_source(run.to_string(), what, remedy)
    }

    /// Returns the hash of the run at each sealed tick before the branch.
    fn seals(&self) -> anyhow::Result<BTreeMap<Tick, String>> {
        let mut seals = BTreeMap::new();
        for row in self.logged.each_row::<TickRow>() {
            let row = row?;
            if row.robot == WORLD_ROBOT && row.section == RUN_SECTION {
                seals.insert(row.tick, format!("{:016x}", row.hash));
            }
        }
        Ok(seals)
    }

    /// Creates the team of the branch at tick 0, with its log.
    ///
    /// # Errors
    /// Returns the errors of the sink, or of a mission that this program does not contain.
    pub fn team<S: Sink>(&self, level: LogLevel, sink: S) -> anyhow::Result<Team<S>> {
        let setup = setup_of(&self.logged)?;
        let answers = LoggedAnswers::of(&self.logged)?;
        let answers = answers.map(|answers| Box::new(answers) as Box<dyn AnswerSource>);
        let mut team = Team::with_answer_source(setup, self.inputs.clone(), level, sink, answers)?;
        team.set_origin(self.origin.clone())?;
        Ok(team)
    }

    /// Repeats a new team up to tick `until` or the end of the run, and applies the changes at the tick of the branch. `see` is
    /// called after each tick.
    ///
    /// # Errors
    /// Returns the errors of the log and of `see`, and a change that the state refuses.
    pub fn repeat<S: Sink>(
        &self,
        mut team: Team<S>,
        until: Tick,
        mut see: impl FnMut(&Team<S>) -> anyhow::Result<()>,
    ) -> anyhow::Result<Team<S>> {
        let BranchRequest { tick, changes, .. } = &self.request;
        loop {
            let now = team.simulation().tick();
            if now == *tick && !changes.is_empty() {
                self.check_ids(team.simulation())?;
                team.branch(changes).context("--set")?;
            }
            if now >= until || team.tick()?.is_some() {
                return Ok(team);
            }
            see(&team)?;
        }
    }

    /// Checks that no id of a new fault is that of a fault of the run.
    fn check_ids(&self, simulation: &Simulation) -> anyhow::Result<()> {
        let taken = simulation.faults();
        for order in self.request.changes.faults.iter().flatten() {
            if let Some(id) = &order.id
                && taken.iter().any(|fault| fault.id == *id)
            {
                let what = format!("'{id}' is already the id of another fault of the run");
                let remedy = "choose another id, or omit it";
                bail!(Problem::with_source("--faults", what, remedy));
            }
        }
        Ok(())
    }

    /// Repeats the run with its log up to the hand-over.
    ///
    /// # Errors
    /// Returns the errors of [`BranchPlan::team`] and [`BranchPlan::repeat`].
    pub fn world<S: Sink>(&self, sink: S) -> anyhow::Result<Team<S>> {
        let team = self.team(self.request.log, sink)?;
        self.repeat(team, self.hand_over_tick(), |_| Ok(()))
    }

    /// Repeats the run up to the hand-over and returns the agent of a robot.
    ///
    /// # Errors
    /// If the robot is unknown or has no agent then.
    pub fn agent(&self, robot: &str) -> anyhow::Result<AgentSnapshot> {
        let team = self.team(LogLevel::Off, run_log::MemoryLog::default())?;
        let mut team = self.repeat(team, self.hand_over_tick(), |_| Ok(()))?;
        let found = team.simulation().robot_named(robot);
        let agent = found.and_then(|robot| team.take_agent(robot));
        agent.with_context(|| format!("{robot} has no agent in tick {}", self.hand_over_tick()))
    }
}

fn vocabulary() -> Vocabulary {
    Registry::current().vocabulary()
}

/// Returns whether an input describes the start of the run: a robot that joined, or without which the run began.
fn is_start(line: &InputLine) -> bool {
    let is_start = match line.input {
        Input::Join { moment, .. } => moment.is_none(),
        Input::Gone { incarnation, .. } => incarnation == 0,
        _ => false,
    };
    is_start && line.tick == 0
}

/// Merges the changes with those of the run at the same tick, if the run is a branch itself. The new ones have precedence.
fn merge_earlier_branch(changes: &mut Branch, inputs: &mut Vec<InputLine>, tick: Tick) {
    let is_earlier =
        |line: &mut InputLine| line.tick == tick && matches!(line.input, Input::Branch(_));
    for line in inputs.extract_if(.., is_earlier) {
        if let Input::Branch(earlier) = line.input {
            changes.faults = changes.faults.take().or(earlier.faults);
            for (key, value) in earlier.parameters {
                changes.parameters.entry(key).or_insert(value);
            }
        }
    }
}
