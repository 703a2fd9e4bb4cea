//! Child processes of a run: start, state changes, signals and the end of their logs.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, bail};
use cluster::os_process::{LAUNCHER, has_launcher};
use cluster::process_log::child_variables;
use nix::sys::prctl;
use nix::sys::signal::{Signal, kill, killpg};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;
use terminal::panics::PANICKED;
use tokio::time::{Instant, sleep};

use super::{controllers, shell};
use cluster::start::{HostCommandLine, InputHold};

/// The time for a process to end by itself, and again after SIGTERM, before it is killed.
pub const GRACE: Duration = Duration::from_secs(3);

/// The number of log lines that are shown when a process fails.
const LAST_LINES: usize = 12;

/// The size of a log above which it is trimmed, bytes.
const LOG_MAX: u64 = 64_000_000;

/// The text at the place of a removed part.
const TRIMMED: &[u8] = b"\n... output was removed here ...\n";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessChange {
    Stopped,
    Continued,
    Ended(Ending),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    Exit(i32),
    Signal(i32),
}

pub struct Process {
    name: String,
    pid: Pid,
    log: PathBuf,
    /// `true` if signals go to the entire process group, because the child is an external program that may have children.
    has_group: bool,
    stopped: bool,
    ending: Option<Ending>,
    /// `true` if a part of the log has been removed.
    is_trimmed: bool,
}

impl Process {
    /// Starts this program with other arguments and appends its output to `log`. The child has its own process group, so that Ctrl-C
    /// reaches only the launcher. It dies with the launcher.
    ///
    /// # Errors
    /// If the program cannot be started or the log cannot be written.
    pub fn start(name: &str, log: &Path, arguments: &[String]) -> anyhow::Result<Self> {
        Self::start_with(name, log, arguments, Stdio::null(), &[], false)
    }

    /// Starts the external controller of a robot. See [`Process::start`].
    pub fn start_controller(
        robot: &str,
        log: &Path,
        command: &str,
        run: &str,
    ) -> anyhow::Result<Self> {
        let arguments = shell::invocation(command, &[]);
        let variables = controllers::variables(robot, run);
        Self::start_with(robot, log, &arguments, Stdio::null(), &variables, true)
    }

    /// Starts the command that runs another host's daemon, with its keys as standard input. See [`Process::start`].
    pub fn start_host(host: &HostCommandLine, logs: &Path) -> anyhow::Result<(Self, InputHold)> {
        let (input, hold) = host.input().context("standard input of a host")?;
        let name = format!("host {}", host.name);
        let log = logs.join(format!("host.{}.log", host.name));
        let arguments = shell::invocation(&host.command, &host.arguments);
        let process = Self::start_with(&name, &log, &arguments, input.into(), &[], true)?;
        Ok((process, hold))
    }

    /// Starts a process with a standard input and more environment variables. See [`Process::start`].
    pub fn start_with(
        name: &str,
        log: &Path,
        arguments: &[String],
        input: Stdio,
        variables: &[(&str, String)],
        has_group: bool,
    ) -> anyhow::Result<Self> {
        let program = std::env::current_exe().context("finding this program")?;
        // Later incarnations of a robot append to the same log.
        let output = File::options()
            .append(true)
            .create(true)
            .open(log)
            .with_context(|| log.display().to_string())?;
        let child = Command::new(&program)
            .args(arguments)
            .env(LAUNCHER, std::process::id().to_string())
            .envs(child_variables())
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
            is_trimmed: false,
        })
    }

    /// Returns the name of the robot, or another label such as "world".
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    #[must_use]
    pub fn pid(&self) -> u32 {
        self.pid.as_raw() as u32
    }

    /// Returns `true` while a signal keeps the process stopped.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Returns the end of the process; `None` while it runs.
    #[must_use]
    pub fn ending(&self) -> Option<Ending> {
        self.ending
    }

    /// Returns the next state change since the last call, if there is one.
    ///
    /// # Errors
    /// If the process does not exist or is no child of this process.
    pub fn poll(&mut self) -> io::Result<Option<ProcessChange>> {
        if self.ending.is_some() {
            return Ok(None);
        }
        let flags = WaitPidFlag::WNOHANG | WaitPidFlag::WUNTRACED | WaitPidFlag::WCONTINUED;
        let change = match waitpid(self.pid, Some(flags))? {
            WaitStatus::Stopped(..) => ProcessChange::Stopped,
            WaitStatus::Continued(_) => ProcessChange::Continued,
            WaitStatus::Exited(_, status) => ProcessChange::Ended(Ending::Exit(status)),
            WaitStatus::Signaled(_, signal, _) => {
                ProcessChange::Ended(Ending::Signal(signal as i32))
            }
            _ => return Ok(None),
        };
        match change {
            ProcessChange::Stopped => self.stopped = true,
            ProcessChange::Continued => self.stopped = false,
            ProcessChange::Ended(ending) => self.ending = Some(ending),
        }
        Ok(Some(change))
    }

    pub fn signal(&self, signal: Signal) {
        if self.ending.is_none() {
            // An error means that the process has just ended.
            let _ = if self.has_group {
                killpg(self.pid, signal)
            } else {
                kill(self.pid, signal)
            };
        }
    }

    /// Removes the newer part of a log that is larger than `LOG_MAX`. Returns `true` the first time. A program that writes
    /// without a pause would fill the disk within minutes.
    pub fn trim_log(&mut self) -> bool {
        let is_large = std::fs::metadata(&self.log).is_ok_and(|log| log.len() > LOG_MAX);
        if !is_large {
            return false;
        }
        // The process appends to the file, so it continues at the new end. A failure leaves the log as it is.
        let log = File::options().append(true).open(&self.log);
        let _ = log.and_then(|mut log| {
            log.set_len(LOG_MAX / 2)?;
            log.write_all(TRIMMED)
        });
        !std::mem::replace(&mut self.is_trimmed, true)
    }

    /// Returns the line for a log that is trimmed for the first time.
    #[must_use]
    pub fn trimmed(&self) -> String {
        format!(
            "{} writes much output: {} keeps only the first {} MB and the newest",
            self.name,
            self.log.display(),
            LOG_MAX / 2 / 1_000_000
        )
    }

    /// Returns the last log lines for an error message, or the reason why there are none.
    #[must_use]
    pub fn failure_output(&self) -> String {
        let lines = self.last_log_lines();
        if lines.is_empty() {
            let log = self.log.display();
            match self.ending {
                _ if !self.log.exists() => {
                    format!("its log {log} is gone: check whether the run folder was deleted")
                }
                Some(Ending::Signal(_)) => format!("its log {log} is empty"),
                _ => format!("its log {log} is empty: check whether the disk is full"),
            }
        } else {
            format!("its last output:\n{lines}")
        }
    }

    /// Returns the last lines of the log, indented.
    #[must_use]
    pub fn last_log_lines(&self) -> String {
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
    /// Returns the end as a phrase that follows the name of the process.
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

/// Requests a signal for this process when its launcher dies. Without a launcher it does nothing.
pub fn die_with_launcher() -> anyhow::Result<()> {
    let Ok(launcher) = std::env::var(LAUNCHER) else {
        return Ok(());
    };
    // The world receives SIGTERM, so that it completes its log, and the bridge, so that it stops the bodies. Agents receive SIGKILL, because SIGTERM does not end a stopped process.
    let words: Vec<String> = std::env::args().skip(1).take(3).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let signal = if let ["cluster", "world", ..] | ["cluster", "ros", "--bodies"] = *words {
        Signal::SIGTERM
    } else {
        Signal::SIGKILL
    };
    prctl::set_pdeathsig(signal).context("requesting the end with the launcher")?;
    if !has_launcher() {
        bail!("the launcher (process {launcher}) has ended");
    }
    Ok(())
}

/// Ends processes: waits for `patience`, then sends SIGTERM, then SIGKILL.
pub async fn end_processes(
    mut processes: Vec<&mut Process>,
    patience: Duration,
    say: &(dyn Fn(&str) + Sync),
) {
    let steps = [
        (None, patience),
        (Some(Signal::SIGTERM), GRACE),
        (Some(Signal::SIGKILL), GRACE),
    ];
    for (signal, patience) in steps {
        if let Some(signal) = signal {
            for process in processes
                .iter()
                .filter(|process| process.ending().is_none())
            {
                if signal == Signal::SIGKILL {
                    say(&format!("{} had to be killed", process.name()));
                }
                process.signal(signal);
            }
        }
        let until = Instant::now() + patience;
        while Instant::now() < until {
            let mut left = false;
            for process in &mut processes {
                if process.ending().is_none() && process.trim_log() {
                    say(&process.trimmed());
                }
                // A process whose state cannot be read has ended.
                while let Ok(Some(_)) = process.poll() {}
                left |= process.ending().is_none();
            }
            if !left {
                return;
            }
            sleep(Duration::from_millis(10)).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn process(log: PathBuf, ending: Option<Ending>) -> Process {
        Process {
            name: "r1".to_owned(),
            pid: Pid::this(),
            log,
            has_group: true,
            stopped: false,
            ending,
            is_trimmed: false,
        }
    }

    #[test]
    fn a_log_that_grows_without_a_bound_is_trimmed_and_reported_once() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("r1.log");
        let file = File::create(&log).unwrap();
        let mut process = process(log.clone(), None);
        file.set_len(LOG_MAX).unwrap();
        assert!(!process.trim_log());
        for is_first in [true, false] {
            file.set_len(3 * LOG_MAX).unwrap();
            assert_eq!(process.trim_log(), is_first);
            let left = file.metadata().unwrap().len();
            assert_eq!(left, LOG_MAX / 2 + TRIMMED.len() as u64);
        }
        let line = format!(
            "r1 writes much output: {} keeps only the first 32 MB and the newest",
            log.display()
        );
        assert_eq!(process.trimmed(), line);
    }

    #[test]
    fn an_empty_log_of_a_killed_process_does_not_suggest_a_full_disk() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("world.log");
        File::create(&log).unwrap();
        let output = |ending| process(log.clone(), Some(ending)).failure_output();
        let killed = output(Ending::Signal(9));
        assert_eq!(killed, format!("its log {} is empty", log.display()));
        assert!(output(Ending::Exit(1)).ends_with("check whether the disk is full"));
        std::fs::remove_file(&log).unwrap();
        assert!(output(Ending::Exit(1)).ends_with("check whether the run folder was deleted"));
    }
}
