//! The channels of a run for Foxglove: a process that reads the log of the run and serves it over WebSockets. Clients play a
//! finished run with the controls of the protocol.
//!
//! Without control, nothing that a client sends reaches the run. With control, clients use the control topic of the run,
//! as the page and `alliance fault` do.

#[cfg(feature = "foxglove")]
mod channels;
#[cfg(feature = "foxglove")]
mod control;
#[cfg(feature = "foxglove")]
mod playback;
#[cfg(feature = "foxglove")]
mod publish;
#[cfg(not(feature = "foxglove"))]
#[path = "without_foxglove.rs"]
mod publish;

use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::process::ExitCode;

use analysis::{LATEST, optional};
use clap::Args;
use cluster::process_log::{LogArgs, log_to_stderr};
use run_log::LogLevel;
use scenario::{Problem, Setup};
use terminal::fail;
use world_server::args::address;

use crate::run::observers::ObserverCommand;

/// The name of the process and its option.
const FOXGLOVE: &str = "foxglove";

/// The option of `alliance run`, for error messages.
const OPTION: &str = "--foxglove";

/// The address at which Foxglove expects a server.
pub const ADDRESS: &str = "127.0.0.1:8765";

/// The options of a run with channels for Foxglove.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Foxglove")]
pub struct FoxgloveArgs {
    /// Serve the run to Foxglove at this address [default: 127.0.0.1:8765], at 1x without --speed
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = ADDRESS,
        value_parser = address,
        hide = !cfg!(feature = "foxglove")
    )]
    foxglove: Option<SocketAddr>,
    /// Accept faults and clock commands from every client on this machine
    #[arg(long, requires = "foxglove", hide = !cfg!(feature = "foxglove"))]
    foxglove_control: bool,
}

/// Serve a run to Foxglove
#[derive(Args, Clone, Debug)]
pub struct FoxgloveCommand {
    /// Folder of the run
    #[arg(value_name = "RUN", default_value = LATEST)]
    folder: PathBuf,
    /// Address of the server
    #[arg(long, value_name = "ADDRESS", default_value = ADDRESS, value_parser = address)]
    address: SocketAddr,
    /// Accept faults and clock commands for the live run with this id
    #[arg(long, value_name = "ID")]
    control: Option<String>,
    /// Serve from the start of the run, and wait for its folder
    #[arg(long, hide = true)]
    from_start: bool,
    #[command(flatten)]
    log: LogArgs,
}

impl FoxgloveArgs {
    /// Returns whether the run is served to Foxglove.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.foxglove.is_some()
    }

    /// Checks a run before it starts. The returned listener keeps the address from others.
    ///
    /// # Errors
    /// Returns an error if this program has no support of Foxglove, if the run cannot be followed, or if nothing can listen
    /// at the address.
    pub fn check(&self, setup: &Setup, log: LogLevel) -> anyhow::Result<Option<TcpListener>> {
        let Some(address) = self.foxglove else {
            return Ok(None);
        };
        check_feature(OPTION)?;
        publish::check(setup, log)?;
        check_control(self.foxglove_control, address, "--foxglove-control")?;
        let listener = TcpListener::bind(address);
        Ok(Some(listener.map_err(|error| {
            refused(format!("{OPTION} {address}"), &error)
        })?))
    }

    /// Returns the process that serves the run with this id, if there is one.
    #[must_use]
    pub fn observer(&self, folder: PathBuf, run: &str) -> Option<ObserverCommand> {
        let command = FoxgloveCommand {
            folder,
            address: self.foxglove?,
            control: self.foxglove_control.then(|| run.to_owned()),
            from_start: true,
            log: LogArgs::default(),
        };
        Some(ObserverCommand {
            name: FOXGLOVE,
            title: "Foxglove",
            arguments: command.arguments(),
            description: command.describe(),
        })
    }
}

/// Checks that this program supports Foxglove, which the user's words `given` need.
fn check_feature(given: &str) -> anyhow::Result<()> {
    optional::check(given, FOXGLOVE, cfg!(feature = "foxglove"))
}

/// Checks that clients with control are on this machine, because the protocol has no passwords.
fn check_control(has_control: bool, address: SocketAddr, option: &str) -> Result<(), Problem> {
    if has_control && !address.ip().is_loopback() {
        let what = format!("{address} accepts other machines, and clients need no password");
        return Err(Problem::with_source(option, what, "use 127.0.0.1"));
    }
    Ok(())
}

/// Returns the problem of an address that cannot be used; `given` are the user's words.
fn refused(given: String, error: &std::io::Error) -> Problem {
    let remedy = "use a free address of this machine, such as 127.0.0.1:8766";
    Problem::with_source(given, error.to_string(), remedy)
}

impl FoxgloveCommand {
    /// Returns the arguments of the process.
    fn arguments(&self) -> Vec<String> {
        let mut arguments = ["cluster", FOXGLOVE].map(str::to_owned).to_vec();
        arguments.push(self.folder.display().to_string());
        arguments.push(format!("--address={}", self.address));
        if let Some(run) = &self.control {
            arguments.push(format!("--control={run}"));
        }
        if self.from_start {
            arguments.push("--from-start".to_owned());
        }
        arguments
    }

    /// Returns the description for people.
    fn describe(&self) -> String {
        format!("Foxglove ws://{}", self.address)
    }

    /// Starts the log of this process.
    pub fn start_log(&self) {
        log_to_stderr(self.log, FOXGLOVE);
    }

    /// Creates the command that serves the run in this folder at an address.
    #[must_use]
    pub fn new(folder: PathBuf, address: SocketAddr) -> Self {
        Self {
            folder,
            address,
            control: None,
            from_start: false,
            log: LogArgs::default(),
        }
    }

    /// Serves a live run until it is over, or a finished one until an interrupt. `name` is that of the command, for error
    /// messages.
    ///
    /// Exit status 0 at the end of the run or after an interrupt, 2 if the run cannot be served, 3 if its log cannot be
    /// read.
    #[must_use]
    pub fn run(&self, name: &str) -> ExitCode {
        let checked = check_feature("channels for Foxglove");
        let is_local = || check_control(self.control.is_some(), self.address, "--control");
        match checked.and_then(|()| Ok(is_local()?)) {
            Ok(()) => publish::run(name, self),
            Err(error) => fail(name, &error, 2),
        }
    }
}
