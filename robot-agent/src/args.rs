//! Command line of an agent, the same for `robot-agent` and `alliance agent`.

use crate::allocator::AgentRegistry;
use std::io::IsTerminal;
use std::process::ExitCode;
use std::time::Duration;

use alliance_proto::keys::is_name;
use alliance_proto::member::{self, Login, Member};
use alliance_proto::rendezvous::{Rendezvous, RendezvousError};
use alliance_proto::session::LOG_FILTER;
use alliance_proto::tell;
use clap::Args;
use tokio::time::{Instant, sleep, timeout_at};

use crate::far::{self, FarArgs};
use crate::process::{AgentError, End, live};

/// Environment variables that tell a mind which robot of which run it is to be.
pub const ROBOT: &str = "ALLIANCE_ROBOT";
/// See [`ROBOT`].
pub const RUN: &str = "ALLIANCE_RUN";

/// How long an agent waits for the run that was named to appear.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long a broken way to the world may take to be mended; who has lived for so long has found it whole.
const MENDED: Duration = Duration::from_secs(30);

/// How often it looks.
const LOOK_INTERVAL: Duration = Duration::from_millis(10);

/// Be one robot of a live run.
#[derive(Args, Clone, Debug)]
pub struct AgentArgs {
    /// Robot to be, one of the scenario's [default: ALLIANCE_ROBOT of the environment]
    #[arg(long, value_name = "NAME", value_parser = robot_name)]
    pub robot: Option<String>,
    /// Run to join, by its id [default: ALLIANCE_RUN of the environment, if that names the robot too; else the newest live run of this
    /// user]
    #[arg(long, value_name = "ID", conflicts_with = "connect")]
    pub run: Option<String>,
    /// How it connects from another host.
    #[command(flatten)]
    pub far: FarArgs,
}

impl AgentArgs {
    /// Joins the run and lives until it ends. Says on stderr how it ended.
    ///
    /// Exit status 0 when the run was over or somebody asked the agent to end, 2 for a mistake in the arguments or keys, 3 when it was
    /// refused or the bus failed.
    #[must_use]
    pub fn run(&self, registry: &AgentRegistry) -> ExitCode {
        ExitCode::from(self.run_as(registry, None))
    }

    /// The same with the registry's mind of that name, whatever the scenario gives to the robot; returns the exit status.
    #[must_use]
    pub fn run_as(&self, registry: &AgentRegistry, mind: Option<&str>) -> u8 {
        let Some(robot) = self.robot() else {
            tell!("robot-agent: which robot? State --robot NAME, or {ROBOT} in the environment");
            return 2;
        };
        let login = match self.far.login(&member::robot(&robot)) {
            Ok(login) => login.map(|(login, _)| login),
            Err(error) => {
                tell!("robot-agent {robot}: {error:#}");
                return 2;
            }
        };
        match self.live(&robot, login.as_ref(), registry, mind) {
            Ok(End::RunOver(outcome)) => {
                tracing::info!(outcome = outcome.as_str(), "run over");
                0
            }
            Ok(End::Asked) => 0,
            Ok(End::Superseded) => fail(&robot, "a newer agent has the robot"),
            Ok(End::WorldGone) => fail(&robot, "the world is gone"),
            Err(error) => fail(&robot, &format!("{error:#}")),
        }
    }

    /// The robot that is stated, or the one that whoever started this process has named.
    fn robot(&self) -> Option<String> {
        let named = || std::env::var(ROBOT).ok().filter(|name| is_name(name));
        self.robot.clone().or_else(named)
    }

    /// The same of the run; where the robot is stated, so is the run, or it is the newest.
    fn run_id(&self) -> Option<String> {
        let named = || std::env::var(RUN).ok().filter(|_| self.robot.is_none());
        self.run.clone().or_else(named)
    }

    fn live(
        &self,
        robot: &str,
        login: Option<&Login>,
        registry: &AgentRegistry,
        mind: Option<&str>,
    ) -> anyhow::Result<End> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            // Zenoh refuses a scheduler on the current thread; one worker is all there is to do for.
            .worker_threads(1)
            .enable_all()
            .build()?;
        runtime.block_on(self.live_and_again(robot, login, registry, mind))
    }

    /// The way to a world on another host may break: then it is tried again for a while, as a new incarnation.
    async fn live_and_again(
        &self,
        robot: &str,
        login: Option<&Login>,
        registry: &AgentRegistry,
        mind: Option<&str>,
    ) -> anyhow::Result<End> {
        let mut lost: Option<Instant> = None;
        loop {
            let found = self.find_member(robot, login);
            let member = match lost {
                None => found.await?,
                Some(since) => match timeout_at(since + MENDED, found).await {
                    Ok(member) => member?,
                    Err(_) => return Ok(End::WorldGone),
                },
            };
            let began = Instant::now();
            let lived = live(robot, &member, registry, mind).await;
            let is_lost = matches!(
                lived,
                Ok(End::WorldGone) | Err(AgentError::Bus { .. } | AgentError::NoAnswer(_))
            );
            // After a life that long the way was whole again.
            lost = lost.filter(|_| began.elapsed() < MENDED);
            let since = *lost.get_or_insert_with(Instant::now);
            if !member.is_far || !is_lost || since.elapsed() > MENDED {
                return Ok(lived?);
            }
            tracing::warn!(robot, "the world is out of reach; it is tried again");
            sleep(MENDED / 100).await;
        }
    }

    /// What it needs to take part in the run that it is for.
    async fn find_member(&self, robot: &str, login: Option<&Login>) -> anyhow::Result<Member> {
        match login {
            Some(login) => Ok(Member::far(far::find_run(login).await?, login.clone())),
            None => Ok(self.find_run().await?.member(robot)?),
        }
    }

    /// Robots and world may be started in any order: an agent waits for a run for as long as there is none. One that was
    /// named is about to begin or will never do so.
    async fn find_run(&self) -> Result<Rendezvous, RendezvousError> {
        let asked = self.run_id();
        let patience = Instant::now() + PATIENCE;
        let mut waiting = false;
        loop {
            match Rendezvous::find(asked.as_deref()) {
                Err(RendezvousError::None) => {}
                Err(RendezvousError::Unknown { .. }) if Instant::now() < patience => {}
                found => return found,
            }
            if !std::mem::replace(&mut waiting, true) {
                match &asked {
                    None => tracing::info!("no run is live yet; waiting for one"),
                    Some(run) => tracing::info!(run, "it is not live yet; waiting for it"),
                }
            }
            sleep(LOOK_INTERVAL).await;
        }
    }
}

fn fail(robot: &str, why: &str) -> u8 {
    tell!("robot-agent {robot}: {why}");
    3
}

/// Sends the log to stderr: warnings, or what `RUST_LOG` says.
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

/// What could be no robot's name is refused here: nobody else would say so in words of this command.
fn robot_name(text: &str) -> Result<String, String> {
    if is_name(text) {
        Ok(text.to_owned())
    } else {
        Err("use letters, digits, '-' and '_', at most 32".to_owned())
    }
}
