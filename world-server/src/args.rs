//! Command line of a world. `world-server` and `alliance cluster world` use all of it, `alliance run` all but the run id.

use std::collections::BTreeMap;
use std::fs::{create_dir, create_dir_all};
use std::io::ErrorKind;
use std::iter::once;
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, SystemTime};

use anyhow::{Context, bail};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use proto::secret::random;
use proto::tick::Outcome;
use run_log::LogLevel;
use run_log::recorder::Folder;
use scenario::ids::RobotId;
use scenario::limits::read_name;
use scenario::{Problem, Setup};
use terminal::fail;

use cluster::network::{Network, NetworkArgs};
use cluster::process_log::{LogArgs, log_to_stderr};

use crate::error::WorldError;
use crate::gateway;
use crate::metrics;
use crate::mission::WorldKind;
use crate::mission_args::{Known, MissionArgs, positive_time};
use crate::pace::Speed;
use crate::process::{Options, RunResult, serve, serve_from};
use crate::run_state::RunState;

/// The help heading of options for the results of a run.
pub const OUTPUT: &str = "Output";

/// Options of execution. They do not change the result of a run by a single byte.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Execution")]
pub struct RunArgs {
    /// Folder of the log [default: runs/SCENARIO-seedN-TIME]
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    pub out: Option<PathBuf>,
    /// Factor of real time, or max [default: max; 1x if paused at the start]
    #[arg(long, value_name = "max|FACTORx")]
    pub speed: Option<Speed>,
    /// Start with the clock paused
    #[arg(long)]
    pub paused: bool,
    /// Amount of logged data [default: compact; summary above 2,000 behavior sets]
    #[arg(long, value_name = "LEVEL", value_parser = log_level(), help_heading = OUTPUT)]
    pub log: Option<LogLevel>,
    /// Continue without an agent after this wall-clock time without an answer
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = positive_time, allow_negative_numbers = true)]
    pub stall_after: f64,
    /// Serve metrics for Prometheus and the health at this address, such as 127.0.0.1:9464
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    pub metrics: Option<SocketAddr>,
    #[command(flatten)]
    pub log_args: LogArgs,
}

/// Run a world: physics, sensing and the step clock
#[derive(Args, Clone, Debug)]
pub struct WorldArgs {
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    run: RunArgs,
    /// Id of the run, one word [default: scenario and process id]
    #[arg(long = "run", value_name = "ID", value_parser = read_name)]
    id: Option<String>,
    #[command(flatten)]
    network: NetworkArgs,
    /// Set if a launcher started this world
    #[arg(long, hide = true)]
    launched: bool,
    /// Version of an external controller
    #[arg(long, hide = true, value_name = "NAME=VERSION", value_parser = controller_version)]
    controller_version: Vec<(String, String)>,
    /// Take the poses of the bodies from a bridge to another world, at the socket on standard input
    #[arg(long, hide = true, requires = "launched")]
    external_bodies: bool,
    /// Run as the gateway of a world, which sends the settings on standard input
    #[arg(long, hide = true, exclusive = true)]
    gateway: bool,
}

impl RunArgs {
    /// Returns the folder of the run's log. Without `--out` it creates a new folder below `runs/` at once, so that no other run
    /// can take it.
    ///
    /// # Errors
    /// Fails if the requested folder already contains a run or its name is not UTF-8, or if no folder can be created.
    pub fn folder(&self, setup: &Setup) -> anyhow::Result<PathBuf> {
        if let Some(folder) = &self.out {
            let option = format!("--out {}", folder.display());
            if folder.to_str().is_none() {
                let what = "the name is not valid UTF-8";
                bail!(Problem::with_source(option, what, "use another folder"));
            }
            if folder.join("run.json").exists() {
                bail!(Problem::with_source(
                    option,
                    "already holds a run",
                    "name a new folder"
                ));
            }
            return Ok(folder.clone());
        }
        // The wall clock names the folder only. It has no effect inside the run.
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

    /// Rejects an address for metrics that is not free. The returned listener keeps the address from others.
    ///
    /// # Errors
    /// Fails if nothing can listen at the address.
    pub fn check_metrics(&self) -> Result<Option<TcpListener>, Problem> {
        self.metrics.map(metrics::bind).transpose()
    }

    /// Returns the requested speed. The default is real time if the clock starts paused, and full speed otherwise.
    #[must_use]
    pub fn pace(&self, paused: bool) -> Speed {
        self.speed.unwrap_or(if paused {
            Speed::Factor(1.0)
        } else {
            Speed::Max
        })
    }

    #[must_use]
    pub fn log(&self, setup: &Setup) -> LogLevel {
        self.log
            .unwrap_or_else(|| LogLevel::default_for(setup.behavior_sets()))
    }

    fn options(&self, setup: &Setup, run: String, folder: PathBuf) -> Options {
        Options {
            run,
            folder,
            launched: false,
            network: None,
            ground_truth_robots: Vec::new(),
            controller_versions: BTreeMap::new(),
            speed: self.pace(self.paused),
            paused: self.paused,
            log: self.log(setup),
            stall_after: Duration::from_secs_f64(self.stall_after),
            metrics: self.metrics,
            external_bodies: false,
        }
    }
}

impl WorldArgs {
    /// Starts the log of this process.
    pub fn start_log(&self) {
        let process = if self.gateway { "gateway" } else { "world" };
        log_to_stderr(self.run.log_args, process);
    }

    /// Runs the mission to its end and reports the outcome on stderr.
    ///
    /// Exit status: 0 if the mission is complete, 1 if it ran but is incomplete, 2 for a mistake in the scenario, the
    /// parameters or the arguments, 3 if the bus or the log failed.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        if self.gateway {
            return match gateway::run() {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => fail("gateway", &error, 3),
            };
        }
        let prepared = self.mission.setup(known).and_then(|setup| {
            self.refuse_process_faults(&setup)?;
            self.run.check_metrics()?;
            let network = self.network.network(&setup.scenario)?;
            if network.is_some() && self.id.is_some() && !self.launched {
                let what = "a run over a network has a random id, so that it rejects messages of earlier runs";
                bail!(Problem::with_source("--run with --listen", what, "omit --run"));
            }
            let mission = known.worlds.find(&setup.scenario)?;
            Ok((self.run.folder(&setup)?, setup, mission, network))
        });
        let (folder, setup, mission, network) = match prepared {
            Ok(prepared) => prepared,
            Err(error) => {
                return fail("world", &error, 2);
            }
        };
        let told_truth = known.vocabulary.ground_truth_robots(&setup.scenario);
        match self.serve(setup, mission, folder, told_truth, network) {
            Ok(Outcome::Complete) => ExitCode::SUCCESS,
            Ok(_) => ExitCode::from(1),
            Err(error) => fail("world", &error, 3),
        }
    }

    /// Continues a run from the state that `repeat` returns, which writes the log so far to the folder. Returns the exit status
    /// of [`WorldArgs::run`].
    #[must_use]
    pub fn continue_run(
        &self,
        repeat: impl FnOnce(Folder) -> anyhow::Result<RunState>,
    ) -> ExitCode {
        let (Some(folder), Some(id)) = (&self.run.out, &self.id) else {
            let missing = anyhow::anyhow!("a branch needs --out and --run");
            return fail("world", &missing, 2);
        };
        let state = Folder::create(folder).map_err(anyhow::Error::from);
        let served = state.and_then(repeat).and_then(|state| {
            let setup = state.simulation.setup();
            let options = Options {
                launched: self.launched,
                ..self.run.options(setup, id.clone(), folder.clone())
            };
            Self::finish(&options, setup.seed, serve_from(state, &options))
        });
        match served {
            Ok(Outcome::Complete) => ExitCode::SUCCESS,
            Ok(_) => ExitCode::from(1),
            Err(error) => fail("world", &error, 3),
        }
    }

    /// Rejects faults of processes if no launcher started this world: only a launcher starts and signals processes.
    fn refuse_process_faults(&self, setup: &Setup) -> Result<(), Problem> {
        let timeline = &setup.scenario.faults.timeline;
        match timeline.iter().find(|order| order.fault.affects_process()) {
            Some(order) if !self.launched => {
                let source = format!("scenario '{}'", setup.scenario.name);
                let what = format!("its fault '{}' needs a launcher", order.fault);
                Err(Problem::with_source(
                    source,
                    what,
                    "start it with `alliance run`",
                ))
            }
            _ => Ok(()),
        }
    }

    fn serve(
        &self,
        setup: Setup,
        mission: WorldKind,
        folder: PathBuf,
        told_truth: Vec<RobotId>,
        network: Option<Network>,
    ) -> anyhow::Result<Outcome> {
        let id = match (&self.id, &network) {
            (Some(id), _) => id.clone(),
            (None, None) => run_id_for(&setup),
            (None, Some(_)) => random_run_id(&setup)?,
        };
        let options = Options {
            network,
            ground_truth_robots: told_truth,
            launched: self.launched,
            external_bodies: self.external_bodies,
            controller_versions: self.controller_version.iter().cloned().collect(),
            ..self.run.options(&setup, id, folder)
        };
        let seed = setup.seed;
        Self::finish(&options, seed, serve(setup, mission, &options, Vec::new()))
    }

    /// Runs a world to its end and logs the result.
    fn finish(
        options: &Options,
        seed: u64,
        served: impl Future<Output = Result<RunResult, WorldError>>,
    ) -> anyhow::Result<Outcome> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            // Zenoh does not work with a current-thread scheduler. One worker is enough.
            .worker_threads(1)
            .enable_all()
            .build()
            .context("starting the runtime")?;
        let finished = runtime.block_on(served)?;
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

/// Parses `NAME=VERSION`. The launcher has already validated both parts.
fn controller_version(text: &str) -> Result<(String, String), String> {
    let (name, version) = text.split_once('=').ok_or("use NAME=VERSION")?;
    Ok((name.to_owned(), version.to_owned()))
}

/// Creates a new folder with this name, or with the suffix -2, -3, … if the name is taken.
fn new_folder(parent: &Path, name: &str) -> anyhow::Result<PathBuf> {
    let cannot = |folder: &Path| {
        let folder = folder.display();
        format!("cannot create {folder}; choose another folder with --out")
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
    bail!("{}: no free folder name is left", parent.display())
}

/// Returns a run id that is unique among the live runs of this machine: at most 24 characters of the scenario's name and the
/// process id, 32 characters in total.
#[must_use]
pub fn run_id_for(setup: &Setup) -> String {
    format!("{:.24}-{}", setup.scenario.name, std::process::id())
}

/// Returns a random run id for a run over a network, so that no message of another run fits.
pub fn random_run_id(setup: &Setup) -> std::io::Result<String> {
    Ok(format!(
        "{:.15}-{:016x}",
        setup.scenario.name,
        random()? as u64
    ))
}

/// Parses a log level. `LogLevel` is not a `ValueEnum`, so that programs that only read logs do not depend on clap.
fn log_level() -> impl TypedValueParser<Value = LogLevel> {
    PossibleValuesParser::new(LogLevel::ALL.map(LogLevel::as_str)).map(|name| {
        let mut levels = LogLevel::ALL.into_iter();
        // The parser has already rejected all other words.
        levels
            .find(|level| level.as_str() == name)
            .expect("the parser accepts only names of log levels")
    })
}

/// Parses the address of a server.
///
/// # Errors
/// Returns the remedy as text.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse()
        .map_err(|_| "use an address with a port, such as 127.0.0.1:9464".to_owned())
}

#[cfg(test)]
mod tests {
    use std::thread::scope;

    use super::*;

    #[test]
    fn an_error_without_a_folder_suggests_out() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = new_folder(&file.path().join("runs"), "a").unwrap_err();
        let expected = "runs; choose another folder with --out: ";
        assert!(format!("{error:#}").contains(expected), "{error:#}");
    }

    #[test]
    fn runs_that_start_at_the_same_time_get_different_folders() {
        let runs = tempfile::tempdir().unwrap();
        let parent = runs.path().join("runs");
        let mut created: Vec<PathBuf> = scope(|scope| {
            let all: Vec<_> = (0..8)
                .map(|_| scope.spawn(|| new_folder(&parent, "a").unwrap()))
                .collect();
            all.into_iter()
                .map(|handle| handle.join().unwrap())
                .collect()
        });
        created.sort();
        let names = ["a", "a-2", "a-3", "a-4", "a-5", "a-6", "a-7", "a-8"];
        assert_eq!(created, names.map(|name| parent.join(name)));
    }
}
