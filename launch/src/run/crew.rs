//! The agent processes of one machine: start and state changes.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::PathBuf;
use std::process::Stdio;

use proto::process::ProcessState;
use proto::view::View;
use scenario::Robot;

use super::bus::LauncherBus;
use super::child_processes::{Ending, Process, ProcessChange};

/// The number of processes that start at the same time. With a thousand at once, each takes so long that its session
/// times out.
const STARTING: usize = 64;

/// The environment variable that permits an agent's memory allocator to request pages of 2 MB. With them, each process has
/// 14 MB of its own instead of 6, which the kernel must clear at its start.
const LARGE_PAGES: &str = "MIMALLOC_ALLOW_THP";

/// The agent processes of a launcher or a host daemon.
pub struct AgentProcesses {
    /// The latest process of each robot.
    pub agents: Vec<Process>,
    /// Earlier processes of restarted robots.
    pub former: Vec<Process>,
    /// The robots whose processes start later.
    waiting: VecDeque<String>,
    /// The additional arguments of the processes of [`AgentProcesses::start_all`].
    more: Vec<String>,
    pub run: String,
    /// The commands of external controllers, by robot.
    controllers: BTreeMap<String, String>,
    pub logs: PathBuf,
}

impl AgentProcesses {
    #[must_use]
    pub fn new(run: String, controllers: BTreeMap<String, String>, logs: PathBuf) -> Self {
        Self {
            agents: Vec::new(),
            former: Vec::new(),
            waiting: VecDeque::new(),
            more: Vec::new(),
            run,
            controllers,
            logs,
        }
    }

    /// Starts the agent processes of robots, the first ones now and the others by [`AgentProcesses::start_waiting`]. `more` are
    /// additional arguments, which an external controller does not receive.
    pub fn start_all(
        &mut self,
        robots: impl Iterator<Item = String>,
        more: &[String],
    ) -> anyhow::Result<()> {
        self.waiting.extend(robots);
        self.more = more.to_owned();
        self.start_some(&BTreeSet::new())
    }

    /// Starts more processes if others have joined.
    pub fn start_waiting(&mut self, robots: &[Robot], view: &View) -> anyhow::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        let joined = robots.iter().zip(&view.robots);
        let joined = joined.filter(|(_, robot)| robot.pid.is_some());
        self.start_some(&joined.map(|(robot, _)| robot.name.as_str()).collect())
    }

    fn start_some(&mut self, joined: &BTreeSet<&str>) -> anyhow::Result<()> {
        let is_starting =
            |agent: &&Process| agent.ending().is_none() && !joined.contains(agent.name());
        let starting = self.agents.iter().filter(is_starting).count();
        let more = self.more.clone();
        for _ in starting..STARTING {
            let Some(robot) = self.waiting.pop_front() else {
                break;
            };
            // An order may have started it already.
            if self.agents.iter().all(|agent| agent.name() != robot) {
                self.start_with(&robot, &more)?;
            }
        }
        Ok(())
    }

    /// Returns the robots whose processes start later.
    pub fn waiting(&self) -> impl Iterator<Item = &str> {
        self.waiting.iter().map(String::as_str)
    }

    /// Starts a new agent process for a robot and returns its process id.
    pub fn start(&mut self, robot: &str) -> anyhow::Result<u32> {
        self.start_with(robot, &[])
    }

    fn start_with(&mut self, robot: &str, more: &[String]) -> anyhow::Result<u32> {
        let log = self.logs.join(format!("{robot}.log"));
        let process = match self.controllers.get(robot) {
            Some(command) => Process::start_controller(robot, &log, command, &self.run)?,
            None => {
                let arguments = ["cluster", "agent", "--robot", robot, "--run", &self.run];
                let arguments = arguments.into_iter().map(ToOwned::to_owned);
                let arguments: Vec<String> = arguments.chain(more.iter().cloned()).collect();
                let variables = [(LARGE_PAGES, "0".to_owned())];
                Process::start_with(robot, &log, &arguments, Stdio::null(), &variables, false)?
            }
        };
        let pid = process.pid();
        match self.agents.iter_mut().find(|agent| agent.name() == robot) {
            Some(agent) => {
                let former = std::mem::replace(agent, process);
                self.former.push(former);
            }
            None => self.agents.push(process),
        }
        Ok(pid)
    }

    /// Returns all processes, including earlier ones of restarted robots.
    pub fn all(&mut self) -> impl Iterator<Item = &mut Process> {
        self.agents.iter_mut().chain(&mut self.former)
    }

    /// Returns whether the latest process of a robot has not ended.
    #[must_use]
    pub fn is_any_alive(&self) -> bool {
        self.agents.iter().any(|agent| agent.ending().is_none())
    }

    /// Reports process state changes to the world, and prints them unless the run is over.
    pub async fn poll(
        &mut self,
        mut bus: Option<&mut LauncherBus>,
        say: &(dyn Fn(&str) + Sync),
        over: bool,
    ) -> anyhow::Result<()> {
        for agent in self.all() {
            if agent.trim_log() {
                say(&agent.trimmed());
            }
            while let Some(change) = agent.poll()? {
                let name = agent.name();
                let state = match change {
                    ProcessChange::Stopped => ProcessState::Stopped,
                    ProcessChange::Continued => ProcessState::Continued,
                    ProcessChange::Ended(_) => ProcessState::Ended,
                };
                if let Some(bus) = bus.as_deref_mut() {
                    bus.report_state(name, agent.pid(), state).await;
                }
                if over {
                    continue;
                }
                match change {
                    ProcessChange::Stopped => say(&format!("{name} is stopped")),
                    ProcessChange::Continued => say(&format!("{name} resumes")),
                    ProcessChange::Ended(Ending::Exit(0)) => {}
                    ProcessChange::Ended(ending) => {
                        say(&format!("{name} {}", ending.describe()));
                        if matches!(ending, Ending::Exit(_)) {
                            say(agent.last_log_lines().trim_end());
                        }
                    }
                }
            }
        }
        Ok(())
    }
}
