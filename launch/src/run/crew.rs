//! The agent processes of one machine: start and state changes.

use std::collections::BTreeMap;
use std::path::PathBuf;

use proto::process::ProcessState;

use super::bus::Bus;
use super::child_processes::{Change, Ending, Process};

/// The agent processes of a launcher or a host daemon.
pub struct Crew {
    /// The latest process of each robot.
    pub agents: Vec<Process>,
    /// Earlier processes of restarted robots.
    pub former: Vec<Process>,
    pub run: String,
    /// The commands of external controllers, by robot.
    minds: BTreeMap<String, String>,
    pub logs: PathBuf,
}

impl Crew {
    #[must_use]
    pub fn new(run: String, minds: BTreeMap<String, String>, logs: PathBuf) -> Self {
        Self {
            agents: Vec::new(),
            former: Vec::new(),
            run,
            minds,
            logs,
        }
    }

    /// Starts a new agent process for a robot and returns its process id.
    pub fn start(&mut self, robot: &str) -> anyhow::Result<u32> {
        let log = self.logs.join(format!("{robot}.log"));
        let process = match self.minds.get(robot) {
            Some(command) => Process::start_mind(robot, &log, command, &self.run)?,
            None => {
                let arguments =
                    ["agent", "--robot", robot, "--run", &self.run].map(ToOwned::to_owned);
                Process::start(robot, &log, &arguments)?
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
    pub fn everybody(&mut self) -> impl Iterator<Item = &mut Process> {
        self.agents.iter_mut().chain(&mut self.former)
    }

    /// Reports process state changes to the world, and prints them unless the run is over.
    pub async fn poll(
        &mut self,
        mut bus: Option<&mut Bus>,
        say: &(dyn Fn(&str) + Sync),
        over: bool,
    ) -> anyhow::Result<()> {
        for agent in self.everybody() {
            while let Some(change) = agent.poll()? {
                let name = agent.name();
                let state = match change {
                    Change::Stopped => ProcessState::Stopped,
                    Change::Continued => ProcessState::Continued,
                    Change::Ended(_) => ProcessState::Ended,
                };
                if let Some(bus) = bus.as_deref_mut() {
                    bus.tell(name, agent.pid(), state).await;
                }
                if over {
                    continue;
                }
                match change {
                    Change::Stopped => say(&format!("{name} is stopped")),
                    Change::Continued => say(&format!("{name} resumes")),
                    Change::Ended(Ending::Exit(0)) => {}
                    Change::Ended(ending) => {
                        say(&format!("{name} {}", ending.describe()));
                        if matches!(ending, Ending::Exit(_)) {
                            say(agent.last_words().trim_end());
                        }
                    }
                }
            }
        }
        Ok(())
    }
}
