//! Command line of an agent, the same for `robot-agent` and `alliance cluster agent`.

use crate::registry::AgentRegistry;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use cluster::member::{Login, Member};
use cluster::os_process::has_launcher;
use cluster::process_log::{LogArgs, log_to_stderr, set_run};
use cluster::rendezvous::{Rendezvous, RendezvousError};
use proto::identity;
use scenario::limits::read_name;
use scenario::names::is_name;
use terminal::{stderr_line, write_error_line};
use tokio::time::{Instant, sleep, timeout_at};

use crate::agent::AgentSnapshot;
use crate::process::{AgentEnd, AgentError, run_agent};
use cluster::remote::{self, RemoteArgs};

/// The environment variable that names the robot.
pub const ROBOT: &str = "ALLIANCE_ROBOT";
/// The environment variable that contains the id of the run.
pub const RUN: &str = "ALLIANCE_RUN";

/// The time for which an agent without a launcher waits for the run that the user named.
const RUN_TIMEOUT: Duration = Duration::from_secs(10);

/// The time after which an agent stops reconnecting to a remote world. A connection that lasted this long counts as
/// recovered.
const RECONNECT_LIMIT: Duration = Duration::from_secs(30);

const LOOK_INTERVAL: Duration = Duration::from_millis(10);

/// Start one robot process of a live run
#[derive(Args, Clone, Debug)]
pub struct AgentArgs {
    /// Robot of the scenario [default: the variable ALLIANCE_ROBOT]
    #[arg(long, value_name = "ROBOT", value_parser = read_name)]
    pub robot: Option<String>,
    /// Id of the run [default: ALLIANCE_RUN beside ALLIANCE_ROBOT, else the newest live run]
    #[arg(long, value_name = "ID", conflicts_with = "connect")]
    pub run: Option<String>,
    #[command(flatten)]
    pub remote: RemoteArgs,
    #[command(flatten)]
    pub log: LogArgs,
}

impl AgentArgs {
    /// Starts the log of this process.
    pub fn start_log(&self) {
        log_to_stderr(self.log, &self.robot().unwrap_or_default());
    }

    /// Joins the run and controls the robot until the run ends. Prints the reason on stderr and returns the exit
    /// status.
    ///
    /// The status is 0 when the run ended or a signal stopped the agent, 2 for invalid arguments or keys, and 3 when
    /// the world refused the agent or the bus failed.
    #[must_use]
    pub fn run(&self, registry: &AgentRegistry) -> ExitCode {
        ExitCode::from(self.run_as(registry, None))
    }

    /// Runs like [`AgentArgs::run`], with the registry's controller named `controller` instead of the scenario's. Returns
    /// the exit status.
    #[must_use]
    pub fn run_as(&self, registry: &AgentRegistry, controller: Option<&str>) -> u8 {
        self.run_with(registry, controller, None)
    }

    /// Runs like [`AgentArgs::run`], but continues an agent of a repeated run.
    #[must_use]
    pub fn run_from(&self, registry: &AgentRegistry, snapshot: AgentSnapshot) -> ExitCode {
        ExitCode::from(self.run_with(registry, None, Some(snapshot)))
    }

    fn run_with(
        &self,
        registry: &AgentRegistry,
        controller: Option<&str>,
        snapshot: Option<AgentSnapshot>,
    ) -> u8 {
        let Some(robot) = self.robot() else {
            stderr_line!(
                "robot-agent: no robot is given; use --robot NAME, or set {ROBOT} in the environment"
            );
            return 2;
        };
        let login = match self.remote.login(&identity::robot(&robot)) {
            Ok(login) => login.map(|(login, _)| login),
            Err(error) => {
                write_error_line(format_args!("robot-agent {robot}: {error:#}"));
                return 2;
            }
        };
        match self.live(&robot, login.as_ref(), registry, controller, snapshot) {
            Ok(AgentEnd::RunOver(outcome)) => {
                tracing::info!(outcome = outcome.as_str(), "run over");
                0
            }
            Ok(AgentEnd::Signaled) => 0,
            Ok(AgentEnd::Superseded) => fail(&robot, "a newer agent controls this robot"),
            Ok(AgentEnd::WorldLost) => fail(&robot, "the connection to the world is lost"),
            Err(error) => fail(&robot, &format!("{error:#}")),
        }
    }

    /// Returns the robot of the command line, else the robot of the environment.
    fn robot(&self) -> Option<String> {
        let from_environment = || std::env::var(ROBOT).ok().filter(|name| is_name(name));
        self.robot.clone().or_else(from_environment)
    }

    /// Returns the run of the command line. The environment counts only if it names the robot, too.
    fn run_id(&self) -> Option<String> {
        let from_environment = || std::env::var(RUN).ok().filter(|_| self.robot.is_none());
        self.run.clone().or_else(from_environment)
    }

    fn live(
        &self,
        robot: &str,
        login: Option<&Login>,
        registry: &AgentRegistry,
        controller: Option<&str>,
        snapshot: Option<AgentSnapshot>,
    ) -> anyhow::Result<AgentEnd> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            // Zenoh requires the multi-thread scheduler; one worker is sufficient.
            .worker_threads(1)
            .enable_all()
            .build()?;
        runtime.block_on(self.live_and_again(robot, login, registry, controller, snapshot))
    }

    /// Runs the agent, and reconnects to a remote world for a while after a loss. Each connection is a new
    /// incarnation.
    async fn live_and_again(
        &self,
        robot: &str,
        login: Option<&Login>,
        registry: &AgentRegistry,
        controller: Option<&str>,
        mut snapshot: Option<AgentSnapshot>,
    ) -> anyhow::Result<AgentEnd> {
        let mut lost: Option<Instant> = None;
        loop {
            // The world of a branch first repeats ticks, for as long as that takes.
            let patience = snapshot.is_none().then_some(RUN_TIMEOUT);
            let found = self.find_member(robot, login, patience);
            let member = match lost {
                None => found.await?,
                Some(lost_since) => match timeout_at(lost_since + RECONNECT_LIMIT, found).await {
                    Ok(member) => member?,
                    Err(_) => return Ok(AgentEnd::WorldLost),
                },
            };
            set_run(&member.run);
            let began = Instant::now();
            let result = run_agent(robot, &member, registry, controller, snapshot.take()).await;
            let is_lost = matches!(
                result,
                Ok(AgentEnd::WorldLost) | Err(AgentError::Bus { .. } | AgentError::NoAnswer(_))
            );
            // A connection that lasted this long had recovered from the earlier loss.
            lost = lost.filter(|_| began.elapsed() < RECONNECT_LIMIT);
            let lost_since = *lost.get_or_insert_with(Instant::now);
            if !member.is_remote || !is_lost || lost_since.elapsed() > RECONNECT_LIMIT {
                return Ok(result?);
            }
            tracing::warn!(robot, "the world is unreachable; reconnecting");
            sleep(RECONNECT_LIMIT / 100).await;
        }
    }

    async fn find_member(
        &self,
        robot: &str,
        login: Option<&Login>,
        patience: Option<Duration>,
    ) -> anyhow::Result<Member> {
        match login {
            Some(login) => Ok(Member::remote(
                remote::find_run(login).await?,
                login.clone(),
            )),
            None => Ok(self.find_run(robot, patience).await?.member(robot)?),
        }
    }

    /// Waits for a run if there is none, because robots and world may start in any order. A run that the user named
    /// must appear within `patience`, if there is a limit. A launcher ends its agents if the run cannot begin, so they
    /// wait as long as it runs.
    async fn find_run(
        &self,
        robot: &str,
        patience: Option<Duration>,
    ) -> Result<Rendezvous, RendezvousError> {
        let run = self.run_id();
        let deadline = patience.map(|patience| Instant::now() + patience);
        let mut waiting = false;
        loop {
            match Rendezvous::find(run.as_deref()) {
                Err(RendezvousError::None) => {}
                Err(RendezvousError::Unknown { .. })
                    if deadline.is_none_or(|deadline| Instant::now() < deadline)
                        || has_launcher() => {}
                found => return found,
            }
            if !std::mem::replace(&mut waiting, true) {
                match &run {
                    None => stderr_line!(
                        "robot-agent {robot}: no run is live; waiting for the next, such as of `alliance cluster world`"
                    ),
                    Some(run) => tracing::info!(run, "the run is not live yet; waiting for it"),
                }
            }
            sleep(LOOK_INTERVAL).await;
        }
    }
}

fn fail(robot: &str, why: &str) -> u8 {
    write_error_line(format_args!("robot-agent {robot}: {why}"));
    3
}
