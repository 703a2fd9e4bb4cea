//! The processes of a run: started, watched and ended by their ids.

use std::fs::File;
use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use alliance_proto::os_process::LAUNCHER;
use alliance_proto::panics::PANICKED;
use anyhow::{Context, bail};
use nix::sys::prctl;
use nix::sys::signal::{Signal, kill, killpg};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::{Pid, getppid};

use super::{minds, shell};
use crate::cluster::start::{Hold, HostStart};

/// How many of the last lines of a log are shown when its process fails.
const LAST_LINES: usize = 12;

/// What happened to a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// A signal stopped it.
    Stopped,
    /// SIGCONT let it go on.
    Continued,
    /// It ended.
    Ended(Ending),
}

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// By itself, with this status.
    Exit(i32),
    /// By this signal.
    Signal(i32),
}

/// A process of the run.
pub struct Process {
    name: String,
    pid: Pid,
    log: PathBuf,
    /// Signals go to all of its group: what runs there is not this program, and may have children.
    has_group: bool,
    stopped: bool,
    ending: Option<Ending>,
}

impl Process {
    /// Starts this program again with other arguments; what it prints goes to its log file. It gets a process group of its
    /// own, so that Ctrl-C reaches the launcher alone, and dies with the launcher.
    ///
    /// # Errors
    /// When the program cannot be started or its log not be written.
    pub fn start(name: &str, log: &Path, arguments: &[String]) -> anyhow::Result<Self> {
        Self::start_with(name, log, arguments, Stdio::null(), &[], false)
    }

    /// The same of a robot's mind that is a program of its own.
    ///
    /// # Errors
    /// As of [`Process::start`].
    pub fn start_mind(robot: &str, log: &Path, command: &str, run: &str) -> anyhow::Result<Self> {
        let arguments = shell::invocation(command, &[]);
        let variables = minds::variables(robot, run);
        Self::start_with(robot, log, &arguments, Stdio::null(), &variables, true)
    }

    /// The same of what starts another host's daemon, with its keys as standard input.
    ///
    /// # Errors
    /// As of [`Process::start`].
    pub fn start_host(host: &HostStart, logs: &Path) -> anyhow::Result<(Self, Hold)> {
        let (input, hold) = host.input().context("standard input of a host")?;
        let name = format!("host {}", host.name);
        let log = logs.join(format!("host-{}.log", host.name));
        let arguments = shell::invocation(&host.command, &host.arguments);
        let process = Self::start_with(&name, &log, &arguments, input.into(), &[], true)?;
        Ok((process, hold))
    }

    /// The same, with another standard input and more environment variables.
    ///
    /// # Errors
    /// As of [`Process::start`].
    pub fn start_with(
        name: &str,
        log: &Path,
        arguments: &[String],
        input: Stdio,
        variables: &[(&str, String)],
        has_group: bool,
    ) -> anyhow::Result<Self> {
        let program = std::env::current_exe().context("finding this program")?;
        // A robot's later lives write below its earlier ones.
        let output = File::options()
            .append(true)
            .create(true)
            .open(log)
            .with_context(|| log.display().to_string())?;
        let child = Command::new(&program)
            .args(arguments)
            .env(LAUNCHER, std::process::id().to_string())
            .envs(variables.iter().map(|(name, value)| (name, value)))
            .stdin(input)
            .stdout(output.try_clone().context("log file")?)
            .stderr(output)
            .process_group(0)
            .spawn()
            .with_context(|| format!("starting {}", program.display()))?;
        Ok(Self {
            name: name.to_owned(),
            pid: Pid::from_raw(child.id() as i32),
            log: log.to_owned(),
            has_group,
            stopped: false,
            ending: None,
        })
    }

    /// Name of the robot, or "world".
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Process id.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.pid.as_raw() as u32
    }

    /// Whether a signal has stopped it.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// How it ended, once it has.
    #[must_use]
    pub fn ending(&self) -> Option<Ending> {
        self.ending
    }

    /// The next thing that has happened to it, if any.
    ///
    /// # Errors
    /// When the operating system does not know the process.
    pub fn poll(&mut self) -> io::Result<Option<Change>> {
        if self.ending.is_some() {
            return Ok(None);
        }
        let flags = WaitPidFlag::WNOHANG | WaitPidFlag::WUNTRACED | WaitPidFlag::WCONTINUED;
        let change = match waitpid(self.pid, Some(flags))? {
            WaitStatus::Stopped(..) => Change::Stopped,
            WaitStatus::Continued(_) => Change::Continued,
            WaitStatus::Exited(_, status) => Change::Ended(Ending::Exit(status)),
            WaitStatus::Signaled(_, signal, _) => Change::Ended(Ending::Signal(signal as i32)),
            _ => return Ok(None),
        };
        match change {
            Change::Stopped => self.stopped = true,
            Change::Continued => self.stopped = false,
            Change::Ended(ending) => self.ending = Some(ending),
        }
        Ok(Some(change))
    }

    /// Sends a signal, unless it has ended.
    pub fn signal(&self, signal: Signal) {
        if self.ending.is_none() {
            // It may have ended just now; then there is nobody to tell.
            let _ = if self.has_group {
                killpg(self.pid, signal)
            } else {
                kill(self.pid, signal)
            };
        }
    }

    /// What it said last, or why that is not known.
    #[must_use]
    pub fn said(&self) -> String {
        let words = self.last_words();
        if words.is_empty() {
            let log = self.log.display();
            format!("it said nothing that could be written to {log}: is the disk full?")
        } else {
            format!("it said:\n{words}")
        }
    }

    /// Last lines of what it printed, indented.
    #[must_use]
    pub fn last_words(&self) -> String {
        let text = std::fs::read(&self.log).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let lines: Vec<&str> = text.lines().collect();
        let from = lines.len().saturating_sub(LAST_LINES);
        lines[from..]
            .iter()
            .map(|line| format!("    {line}\n"))
            .collect()
    }
}

impl Ending {
    /// In words.
    #[must_use]
    pub fn describe(self) -> String {
        match self {
            Self::Exit(PANICKED) => "crashed".to_owned(),
            Self::Exit(status) => format!("ended with exit status {status}"),
            Self::Signal(number) => {
                let name = Signal::try_from(number).map_or("a signal", Signal::as_str);
                format!("was killed by {name}")
            }
        }
    }
}

/// In a child of a launcher: asks the operating system to end this process, even a stopped one, when the launcher dies.
///
/// # Errors
/// When the launcher is dead already.
pub fn die_with_launcher() -> anyhow::Result<()> {
    let Ok(launcher) = std::env::var(LAUNCHER) else {
        return Ok(());
    };
    // The world is asked, so that it ends its log; SIGTERM does nothing to a stopped agent, so agents are not asked.
    let is_world = std::env::args().nth(1).is_some_and(|part| part == "world");
    let signal = if is_world {
        Signal::SIGTERM
    } else {
        Signal::SIGKILL
    };
    prctl::set_pdeathsig(signal).context("asking to end with the launcher")?;
    if launcher != getppid().to_string() {
        bail!("the launcher (process {launcher}) is gone");
    }
    Ok(())
}
