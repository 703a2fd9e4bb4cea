//! `alliance cluster host`: the daemon of another host in a run, and `alliance cluster router`: the same without agent processes.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::Args;
use cluster::file::check_host_name;
use cluster::key_files::KeyFiles;
use cluster::keyring::Keyring;
use cluster::locator::Locator;
use cluster::member::Login;
use cluster::process_log::{LogArgs, log_to_stderr, set_run};
use cluster::remote::{self, RemoteArgs};
use nix::sys::signal::{Signal as NixSignal, kill};
use nix::unistd::Pid;
use proto::identity;
use proto::process::ProcessAction;
use scenario::Problem;
use terminal::{fail, stderr_line};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::{Instant, sleep};

use crate::run::bus::{BusMessage, LauncherBus};
use crate::run::child_processes::{Ending, end_processes};
use crate::run::crew::AgentProcesses;
use crate::runtime;
use cluster::host_router::Relay;

/// The interval between checks of processes if no order arrives.
const INTERVAL: Duration = Duration::from_millis(200);

/// The time for agents to end by themselves when the world is gone.
const FAREWELL: Duration = Duration::from_secs(1);

/// The end of a run for its host.
enum HostEnd {
    /// The run is over, or the host has no agents that could tell.
    Over,
    /// The world or the connection to it is gone before the end of this run.
    Lost(String),
    Interrupted,
}

/// Start and watch one host's agents, in one run after another
#[derive(Args, Clone, Debug)]
pub struct HostCommand {
    /// Name of this host, as given to the world
    #[arg(long, value_name = "HOST", value_parser = host_name)]
    name: String,
    #[command(flatten)]
    remote: RemoteArgs,
    /// Folder for the output of the agents [default: runs/RUN.HOST]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// End after one run
    #[arg(long)]
    once: bool,
    #[command(flatten)]
    log: LogArgs,
}

/// Connect one host's robots, started by hand, to the world
#[derive(Args, Clone, Debug)]
pub struct RouterCommand {
    /// Name of this host, as given to the world
    #[arg(long, value_name = "HOST", value_parser = host_name)]
    name: String,
    #[command(flatten)]
    remote: RemoteArgs,
    /// Also listen for robots on a network, such as at tls/10.0.0.2:7447
    #[arg(long, value_name = "LOCATOR")]
    listen: Vec<String>,
    /// End after one run
    #[arg(long)]
    once: bool,
    #[command(flatten)]
    log: LogArgs,
}

impl HostCommand {
    /// Starts the log of this process.
    pub fn start_log(&self) {
        log_to_stderr(self.log, &format!("host {}", self.name));
    }

    /// Takes part in runs until it is interrupted.
    ///
    /// Exit status 0 after an interrupt or its only run, 2 for a mistake in the arguments or keys, 3 if the world refused it or the bus
    /// failed.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let daemon = Daemon::new(&self.name, &self.remote, &[], self.once);
        let daemon = daemon.map(|daemon| Daemon {
            starts_agents: true,
            out: self.out.clone(),
            ..daemon
        });
        serve("host", daemon)
    }
}

impl RouterCommand {
    /// Starts the log of this process.
    pub fn start_log(&self) {
        log_to_stderr(self.log, &format!("router {}", self.name));
    }

    /// Routes messages until it is interrupted. The exit status is that of [`HostCommand::run`].
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let daemon = Daemon::new(&self.name, &self.remote, &self.listen, self.once);
        serve("router", daemon)
    }
}

struct Daemon {
    name: String,
    login: Login,
    keys: KeyFiles,
    listen: Vec<String>,
    once: bool,
    starts_agents: bool,
    /// The folder for the output of the agents, if given.
    out: Option<PathBuf>,
}

impl Daemon {
    fn new(name: &str, remote: &RemoteArgs, listen: &[String], once: bool) -> anyhow::Result<Self> {
        let mut places = Vec::new();
        for at in listen {
            let locator = Locator::from_option(at, remote.unencrypted).context("--listen")?;
            places.push(locator.to_string());
        }
        let (login, keys) = remote.login(&identity::host(name))?.context(
            "the address of the world is missing; give --connect LOCATOR and --keys DIR",
        )?;
        if let Some(ends) = login.keyring.as_ref().and_then(Keyring::ends_soon) {
            say(&format!("warning: --keys: {ends}"));
        }
        Ok(Self {
            name: name.to_owned(),
            login,
            keys,
            listen: places,
            once,
            starts_agents: false,
            out: None,
        })
    }

    /// Takes part in one run.
    async fn take_part(&self, signals: &mut Signals) -> anyhow::Result<HostEnd> {
        let relay = tokio::select! {
            relay = Relay::open(&self.name, &self.login, &self.keys, &self.listen) => relay?,
            () = signals.interrupted() => return Ok(HostEnd::Interrupted),
        };
        let robots = relay.enlisted.robots.join(", ");
        set_run(&relay.run);
        say(&format!("run {}: robots {robots}", relay.run));
        let default = || PathBuf::from(format!("runs/{}.{}", relay.run, self.name));
        let folder = self.out.clone().unwrap_or_else(default);
        let mut crew = AgentProcesses::new(relay.run.clone(), [].into(), folder);
        let (session, keys) = (relay.session.clone(), relay.keys.clone());
        let mut bus =
            LauncherBus::join_as_host(session, keys, relay.secret.clone(), &self.name).await?;
        if self.starts_agents {
            std::fs::create_dir_all(&crew.logs).with_context(|| crew.logs.display().to_string())?;
            for robot in &relay.enlisted.start {
                let pid = crew.start(robot)?;
                say(&format!("{robot} is process {pid}"));
            }
        }
        let is_interrupted = self.watch(&relay, &mut crew, &mut bus, signals).await;
        let until = Instant::now() + FAREWELL;
        while matches!(is_interrupted, Ok(false)) && crew.is_any_alive() && Instant::now() < until {
            crew.poll(Some(&mut bus), &say, true).await?;
            sleep(FAREWELL / 50).await;
        }
        // An agent that has received the end of the run returns 0. Without it, an agent waits for the world.
        let is_over = crew.agents.is_empty()
            || crew
                .agents
                .iter()
                .any(|agent| agent.ending() == Some(Ending::Exit(0)));
        end_processes(crew.all().collect(), Duration::ZERO, &say).await;
        let run = relay.run.clone();
        relay.close().await;
        Ok(match (is_interrupted?, is_over) {
            (true, _) => HostEnd::Interrupted,
            (false, true) => {
                say(&format!("run {run} is over"));
                HostEnd::Over
            }
            (false, false) => {
                say(&format!("run {run}: the world is gone"));
                HostEnd::Lost(run)
            }
        })
    }

    /// Returns whether the daemon takes part in another run, or again in the same one.
    async fn continues_after(&self, end: HostEnd, signals: &mut Signals) -> bool {
        match end {
            HostEnd::Interrupted => {
                say(&format!("host {}: ended by a signal", self.name));
                false
            }
            HostEnd::Lost(run) if self.once => tokio::select! {
                returns = remote::does_return(&self.login, &run) => returns,
                () = signals.interrupted() => false,
            },
            HostEnd::Over | HostEnd::Lost(_) => !self.once,
        }
    }

    /// Handles orders and process changes until the world is gone. Returns `true` if the daemon was interrupted.
    async fn watch(
        &self,
        relay: &Relay,
        crew: &mut AgentProcesses,
        bus: &mut LauncherBus,
        signals: &mut Signals,
    ) -> anyhow::Result<bool> {
        let mut children = signal(SignalKind::child())?;
        loop {
            tokio::select! {
                () = signals.interrupted() => return Ok(true),
                () = relay.lost() => return Ok(false),
                _ = children.recv() => {}
                call = bus.call() => if let BusMessage::Order(order, query) = call {
                    let done = crew.execute(&order).await;
                    if let (Ok(pid), ProcessAction::Start) = (&done, order.act) {
                        say(&format!("{} is process {pid} now", order.robot));
                    }
                    bus.answer(&query, order.number, done).await;
                },
                () = sleep(INTERVAL) => {}
            }
            crew.poll(Some(bus), &say, false).await?;
        }
    }
}

struct Signals {
    interrupt: Signal,
    terminate: Signal,
}

impl Signals {
    async fn interrupted(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
    }
}

fn serve(command: &str, daemon: anyhow::Result<Daemon>) -> ExitCode {
    let daemon = match daemon {
        Ok(daemon) => daemon,
        Err(error) => {
            return fail(&format!("alliance cluster {command}"), &error, 2);
        }
    };
    let served = runtime::start_runtime().and_then(|runtime| {
        runtime.block_on(async {
            let mut signals = Signals {
                interrupt: signal(SignalKind::interrupt())?,
                terminate: signal(SignalKind::terminate())?,
            };
            if matches!(daemon.keys, KeyFiles::Memory(_)) {
                end_with_input();
            }
            while daemon
                .continues_after(daemon.take_part(&mut signals).await?, &mut signals)
                .await
            {}
            anyhow::Ok(())
        })
    });
    match served {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&format!("alliance cluster {command}"), &error, 3),
    }
}

/// Ends this process when its standard input ends. A daemon that another machine started has no other sign of that launcher's end.
fn end_with_input() {
    std::thread::spawn(|| {
        // An error also means the end of the input.
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        let _ = kill(Pid::this(), NixSignal::SIGTERM);
    });
}

fn say(line: &str) {
    stderr_line!("{line}");
}

fn host_name(text: &str) -> Result<String, Problem> {
    check_host_name((), text).map(|()| text.to_owned())
}
