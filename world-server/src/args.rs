//! Command line of a world, the same for `world-server`, `alliance world` and, but for the run's id, `alliance run`.

use std::collections::BTreeMap;
use std::fs::{create_dir, create_dir_all};
use std::io::{ErrorKind, IsTerminal};
use std::iter::once;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, SystemTime};

use alliance_proto::ids::RobotId;
use alliance_proto::keys::is_name;
use alliance_proto::log::LogLevel;
use alliance_proto::scenario::{
    ParameterFile, Profile, Scenario, Setup, StepOrder, Vocabulary, instead, text_of,
};
use alliance_proto::secret::random;
use alliance_proto::session::LOG_FILTER;
use alliance_proto::tell;
use alliance_proto::tick::Outcome;
use anyhow::{Context, bail};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::gateway;
use crate::mission::{MissionWorld, Worlds};
use crate::network::{Network, NetworkArgs};
use crate::pace::Speed;
use crate::process::{Options, serve};
use crate::size::SizeArgs;

/// What a program that reads scenarios knows beforehand.
#[derive(Clone, Debug)]
pub struct Known {
    /// What scenarios may speak of, and which come with the missions.
    pub vocabulary: Vocabulary,
    /// The worlds of their missions.
    pub worlds: Worlds,
}

/// What is run.
#[derive(Args, Clone, Debug)]
pub struct MissionArgs {
    /// Scenario: the name of a built-in one, or a TOML file
    #[arg(value_name = "SCENARIO|FILE")]
    pub scenario: Option<String>,
    /// Its size, where it comes in any.
    #[command(flatten)]
    pub size: SizeArgs,
    /// Seed of all random streams
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// Parameter file of the thesis' form (Fig. 3.4); its values beat the scenario's
    #[arg(long, value_name = "FILE")]
    pub params: Option<PathBuf>,
    /// Learned times of the robots, from earlier runs, if there is such a file; at its end `alliance run` writes it anew
    #[arg(long, value_name = "FILE")]
    pub profile: Option<PathBuf>,
    /// When robots step: all at once, or one after the other in rank order [default: the preset's]
    #[arg(long, value_name = "ORDER", value_parser = step_order)]
    pub step_order: Option<StepOrder>,
    /// The rule by which all robots choose their tasks; beats the scenario's; see `alliance allocators`
    #[arg(long, value_name = "NAME")]
    pub allocator: Option<String>,
    /// End the run after this much simulated time, in seconds [default: the scenario's]
    #[arg(long, value_name = "SIM-SECONDS", value_parser = positive, allow_negative_numbers = true)]
    pub limit: Option<f64>,
}

/// How it is run. Nothing of this changes a byte of the run.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// Folder of the run's log [default: runs/SCENARIO-seedN-TIME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Pace: max, or a factor of real time such as 1x [default: max; 1x where somebody looks on from the beginning]
    #[arg(long, value_name = "max|FACTORx")]
    pub speed: Option<Speed>,
    /// Begin with the clock held, until somebody lets it go on
    #[arg(long)]
    pub paused: bool,
    /// How much is logged; the hash is the same at every level [default: full; summary for more than 2,000 behavior sets]
    #[arg(long, value_name = "LEVEL", value_parser = log_level())]
    pub log: Option<LogLevel>,
    /// Go on without an agent that has not answered for this long, in seconds of wall-clock time
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = positive, allow_negative_numbers = true)]
    pub stall_after: f64,
}

/// Own a run: physics, sensing and the step clock. Waits for the robots of the scenario.
#[derive(Args, Clone, Debug)]
pub struct WorldArgs {
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    run: RunArgs,
    /// Id of the run, one word [default: made from the scenario and the process id]
    #[arg(long = "run", value_name = "ID", value_parser = run_id)]
    id: Option<String>,
    /// Where else it is reached than on this machine.
    #[command(flatten)]
    network: NetworkArgs,
    /// A launcher started this world
    #[arg(long, hide = true)]
    launched: bool,
    /// Version of a mind that is a program of its own
    #[arg(long, hide = true, value_name = "NAME=VERSION", value_parser = mind_version)]
    mind_version: Vec<(String, String)>,
    /// Be the gateway of a world, which tells the rest
    #[arg(long, hide = true, exclusive = true)]
    gateway: bool,
}

impl MissionArgs {
    /// Reads scenario and parameter file. Keys of the parameter file that found no use are listed on stderr.
    ///
    /// # Errors
    /// One line that says which file, where, what is wrong and what would be right.
    pub fn setup(&self, known: &Known) -> anyhow::Result<Setup> {
        self.resolve(self.scenario(known)?, known)
    }

    /// The scenario that is asked for, as it is stated.
    ///
    /// # Errors
    /// One line that says which file, where, what is wrong and what would be right.
    pub fn scenario(&self, known: &Known) -> anyhow::Result<Scenario> {
        let asked = self.scenario.as_deref();
        match (self.size.scenario(asked, &known.vocabulary)?, asked) {
            (Some(sized), _) => Ok(sized),
            (None, Some(asked)) => read_scenario(asked, known),
            (None, None) => Ok(known.vocabulary.default_scenario()?),
        }
    }

    /// A run of that scenario, with all else that is asked for. Keys of the parameter file that found no use are listed on stderr.
    ///
    /// # Errors
    /// One line that says which file, where, what is wrong and what would be right.
    pub fn resolve(&self, mut scenario: Scenario, known: &Known) -> anyhow::Result<Setup> {
        if let Some(limit) = self.limit {
            scenario.limit_s = limit;
        }
        if let Some(order) = self.step_order {
            scenario.set_step_order(order);
        }
        if let Some(name) = &self.allocator {
            scenario.allocator = Some(name.clone());
            for robot in &mut scenario.robots {
                robot.allocator = None;
            }
        }
        scenario.check_allocators(&known.vocabulary.allocators)?;
        let parameters = match &self.params {
            None => None,
            Some(path) => Some(ParameterFile::parse(
                &path.display().to_string(),
                &std::fs::read(path).with_context(|| path.display().to_string())?,
            )?),
        };
        let mut resolved = Setup::resolve(scenario, self.seed, parameters.as_ref())?;
        if let Some(path) = &self.profile {
            resolved.setup.profile =
                read_profile(path, &resolved.setup.scenario, &known.vocabulary)?;
        }
        let scenario = &resolved.setup.scenario;
        if let Err(error) = known.worlds.of(scenario)?.start_poses(scenario) {
            let asked = self.scenario.as_deref().unwrap_or(&scenario.name);
            bail!("{asked}: {}", error.of(scenario));
        }
        if !resolved.skipped.is_empty() {
            let skipped: Vec<String> = resolved.skipped.iter().map(ToString::to_string).collect();
            tell!(
                "skipped, for the scenario has no such robot or behavior set: {}",
                skipped.join(", ")
            );
        }
        Ok(resolved.setup)
    }
}

impl RunArgs {
    /// Folder of the run's log: the one asked for, or a new one below `runs/`, which is made here, so that no other run that
    /// begins at this moment takes it.
    ///
    /// # Errors
    /// When the folder asked for already holds a run, or cannot be named to other processes; when none can be made.
    pub fn folder(&self, setup: &Setup) -> anyhow::Result<PathBuf> {
        if let Some(folder) = &self.out {
            if folder.to_str().is_none() {
                bail!(
                    "--out {}: its name is no UTF-8; name another folder",
                    folder.display()
                );
            }
            if folder.join("run.json").exists() {
                bail!(
                    "--out {}: already holds a run; name a new folder",
                    folder.display()
                );
            }
            return Ok(folder.clone());
        }
        // The wall clock names the folder and nothing inside the run.
        #[allow(clippy::disallowed_methods)]
        let time = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
        let time = time.replace([':', '-'], "").replace('T', "-");
        let name = format!(
            "{}-seed{}-{}",
            setup.scenario.name,
            setup.seed,
            time.trim_end_matches('Z')
        );
        new_folder(Path::new("runs"), &name)
    }

    /// The pace that was asked for, or else one that eyes can follow where the clock is held at first.
    #[must_use]
    pub fn pace(&self, paused: bool) -> Speed {
        self.speed.unwrap_or(if paused {
            Speed::Factor(1.0)
        } else {
            Speed::Max
        })
    }

    /// How much of that run is logged.
    #[must_use]
    pub fn log(&self, setup: &Setup) -> LogLevel {
        self.log
            .unwrap_or_else(|| LogLevel::of_a_team(setup.behavior_sets()))
    }

    fn options(&self, setup: &Setup, run: String, folder: PathBuf) -> Options {
        Options {
            run,
            folder,
            launched: false,
            network: None,
            told_truth: Vec::new(),
            minds: BTreeMap::new(),
            speed: self.pace(self.paused),
            paused: self.paused,
            log: self.log(setup),
            stall_after: Duration::from_secs_f64(self.stall_after),
        }
    }
}

impl WorldArgs {
    /// Runs the mission to its end. Says on stderr how it went.
    ///
    /// Exit status 0 when the mission is complete, 1 when it ran but is not, 2 for a mistake in scenario, parameters or
    /// arguments, 3 when the bus or the log failed.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        if self.gateway {
            return match gateway::run() {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => {
                    tell!("gateway: {error:#}");
                    ExitCode::from(3)
                }
            };
        }
        let prepared = self.mission.setup(known).and_then(|setup| {
            self.refuse_process_faults(&setup)?;
            let network = self.network.network(&setup.scenario)?;
            if network.is_some() && self.id.is_some() && !self.launched {
                bail!("--run with --listen: a run over a network has a name that is drawn, so that no message of an earlier one fits; leave --run out");
            }
            let mission = known.worlds.of(&setup.scenario)?;
            Ok((self.run.folder(&setup)?, setup, mission, network))
        });
        let (folder, setup, mission, network) = match prepared {
            Ok(prepared) => prepared,
            Err(error) => {
                tell!("world: {error:#}");
                return ExitCode::from(2);
            }
        };
        let told_truth = known.vocabulary.told_truth(&setup.scenario);
        match self.serve(setup, mission, folder, told_truth, network) {
            Ok(Outcome::Complete) => ExitCode::SUCCESS,
            Ok(_) => ExitCode::from(1),
            Err(error) => {
                tell!("world: {error:#}");
                ExitCode::from(3)
            }
        }
    }

    /// Nobody but a launcher starts and signals processes.
    fn refuse_process_faults(&self, setup: &Setup) -> anyhow::Result<()> {
        let timeline = &setup.scenario.faults.timeline;
        match timeline
            .iter()
            .find(|order| order.fault.is_about_a_process())
        {
            Some(order) if !self.launched => bail!(
                "scenario '{}': its fault '{}' needs a launcher; start it with `alliance run`",
                setup.scenario.name,
                order.fault
            ),
            _ => Ok(()),
        }
    }

    fn serve(
        &self,
        setup: Setup,
        mission: MissionWorld,
        folder: PathBuf,
        told_truth: Vec<RobotId>,
        network: Option<Network>,
    ) -> anyhow::Result<Outcome> {
        let id = match (&self.id, &network) {
            (Some(id), _) => id.clone(),
            (None, None) => run_id_for(&setup),
            (None, Some(_)) => drawn_run_id(&setup)?,
        };
        let options = Options {
            network,
            told_truth,
            launched: self.launched,
            minds: self.mind_version.iter().cloned().collect(),
            ..self.run.options(&setup, id, folder)
        };
        let seed = setup.seed;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            // Zenoh refuses a scheduler on the current thread; one worker is all there is to do for.
            .worker_threads(1)
            .enable_all()
            .build()
            .context("starting the runtime")?;
        let finished = runtime.block_on(serve(setup, mission, &options, Vec::new()))?;
        tracing::info!(
            outcome = finished.outcome.as_str(),
            folder = %options.folder.display(),
            seed,
            hash = finished.hash,
            unscripted = finished.unscripted,
            "run over"
        );
        Ok(finished.outcome)
    }
}

/// As the launcher has checked it.
fn mind_version(text: &str) -> Result<(String, String), String> {
    let (name, version) = text.split_once('=').ok_or("use NAME=VERSION")?;
    Ok((name.to_owned(), version.to_owned()))
}

/// Makes a folder that nobody else has, by that name, or with -2, -3, … behind it.
fn new_folder(parent: &Path, name: &str) -> anyhow::Result<PathBuf> {
    let cannot = |folder: &Path| {
        let folder = folder.display();
        format!("cannot make {folder}, and --out names no other place")
    };
    create_dir_all(parent).with_context(|| cannot(parent))?;
    let later = (2..).map(|number| format!("{name}-{number}"));
    for name in once(name.to_owned()).chain(later) {
        let folder = parent.join(name);
        match create_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => {
                made.with_context(|| cannot(&folder))?;
                return Ok(folder);
            }
        }
    }
    bail!("{}: no name is left", parent.display())
}

/// What is in that file; nothing if there is none.
fn read_profile(
    path: &Path,
    scenario: &Scenario,
    vocabulary: &Vocabulary,
) -> anyhow::Result<Profile> {
    let name = path.display().to_string();
    let mut robots = scenario.robots.iter();
    if !robots.any(|robot| vocabulary.learns(scenario.allocator_of(robot))) {
        let learners = vocabulary.allocators.iter().filter(|spec| spec.learns);
        let learners: Vec<&str> = learners.map(|spec| spec.name).collect();
        bail!(
            "--profile {name}: the robots' allocator is {}, which learns nothing; those that learn are {}",
            scenario.allocators_in_words(),
            learners.join(", ")
        );
    }
    if path.is_dir() {
        bail!("--profile {name}: that is a folder; name a file");
    }
    match std::fs::read(path) {
        Ok(bytes) => {
            let text = text_of(&name, bytes)?;
            Ok(Profile::parse(&name, &text, scenario, vocabulary)?)
        }
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Profile::default()),
        Err(error) => Err(error).with_context(|| format!("--profile {name}")),
    }
}

/// The built-in scenario of that name, or the one in that file.
///
/// # Errors
/// One line that says what is wrong with it, and where.
pub fn read_scenario(asked: &str, known: &Known) -> anyhow::Result<Scenario> {
    if let Some(builtin) = known.vocabulary.builtin(asked) {
        return Ok(Scenario::parse(asked, builtin.text, &known.vocabulary)?);
    }
    let path = Path::new(asked);
    if !path.exists() {
        let builtins = known.vocabulary.builtins().map(|builtin| builtin.name);
        bail!(
            "'{asked}' is neither a built-in scenario nor a file; {}",
            instead(asked, builtins)
        );
    }
    let bytes = std::fs::read(path).with_context(|| asked.to_owned())?;
    let text = text_of(asked, bytes)?;
    Ok(Scenario::parse(asked, &text, &known.vocabulary)?)
}

/// An id that no other live run on this machine has: at most 32 characters: as much of the scenario's name as a process id of seven digits leaves.
#[must_use]
pub fn run_id_for(setup: &Setup) -> String {
    format!("{:.24}-{}", setup.scenario.name, std::process::id())
}

/// An id of a run over a network: no message of another run, be it yesterday's, is one of this.
///
/// # Errors
/// When the system has no random bits.
pub fn drawn_run_id(setup: &Setup) -> std::io::Result<String> {
    Ok(format!(
        "{:.15}-{:016x}",
        setup.scenario.name,
        random()? as u64
    ))
}

/// Sends the log to stderr: what a person wants to know of a world, or what `RUST_LOG` says.
pub fn log_to_stderr() {
    let filter =
        tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| LOG_FILTER.into());
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        // A line that cannot be written is no reason to write another one, and less to panic.
        .log_internal_errors(false)
        // A log file wants no colors.
        .with_ansi(std::io::stderr().is_terminal())
        .init();
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| format!("use a whole number from 0 to {}", u64::MAX))
}

fn step_order(text: &str) -> Result<StepOrder, String> {
    match text {
        "simultaneous" => Ok(StepOrder::Simultaneous),
        "in-order" => Ok(StepOrder::InOrder),
        _ => Err("use 'simultaneous' or 'in-order'".to_owned()),
    }
}

/// A parser here and no `ValueEnum` there: who reads logs needs no command line.
fn log_level() -> impl TypedValueParser<Value = LogLevel> {
    let described = LogLevel::ALL.map(|level| {
        PossibleValue::new(level.as_str()).help(match level {
            LogLevel::Full => "Every table, every tick",
            LogLevel::Summary => {
                "Events, mission and inputs; ticks.csv with one seal per second of simulated time instead of all hashes"
            }
            LogLevel::Off => "Inputs only",
        })
    });
    PossibleValuesParser::new(described).map(|asked| {
        let mut levels = LogLevel::ALL.into_iter();
        // The parser lets no other word through.
        levels
            .find(|level| level.as_str() == asked)
            .expect("one of the possible values")
    })
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e9 => Ok(seconds),
        _ => Err("use a number of seconds above 0".to_owned()),
    }
}

fn run_id(text: &str) -> Result<String, String> {
    if is_name(text) {
        Ok(text.to_owned())
    } else {
        Err("use letters, digits, '-' and '_', at most 32".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use std::thread::scope;

    use super::*;

    #[test]
    fn where_no_folder_can_be_made_another_can_be_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = new_folder(&file.path().join("runs"), "a").unwrap_err();
        let told = "runs, and --out names no other place: ";
        assert!(format!("{error:#}").contains(told), "{error:#}");
    }

    #[test]
    fn who_begins_at_the_same_moment_gets_a_folder_of_its_own() {
        let runs = tempfile::tempdir().unwrap();
        let parent = runs.path().join("runs");
        let mut made: Vec<PathBuf> = scope(|scope| {
            let all: Vec<_> = (0..8)
                .map(|_| scope.spawn(|| new_folder(&parent, "a").unwrap()))
                .collect();
            all.into_iter().map(|one| one.join().unwrap()).collect()
        });
        made.sort();
        let names = ["a", "a-2", "a-3", "a-4", "a-5", "a-6", "a-7", "a-8"];
        assert_eq!(made, names.map(|name| parent.join(name)));
    }

    #[test]
    fn a_file_that_is_no_utf_8_is_answered_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, b"step_ms = 50\nname = \"\xff\"\n").unwrap();
        let asked = path.to_str().unwrap();
        let known = Known {
            vocabulary: alliance_proto::testkit::vocabulary(),
            worlds: Worlds::default(),
        };
        let error = read_scenario(asked, &known).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("{asked}:2: these bytes are no UTF-8 text; save the file as UTF-8")
        );
    }
}
