//! The agents' processes of one machine: started, watched, and signalled as the world asks.

use std::collections::BTreeMap;
use std::path::PathBuf;

use alliance_proto::process::ProcessState;

use super::bus::Bus;
use super::children::{Change, Ending, Process};

/// The agents of a launcher.
pub struct Crew {
    /// The latest of each robot.
    pub agents: Vec<Process>,
    /// Those that have been succeeded.
    pub former: Vec<Process>,
    /// Id of the run.
    pub run: String,
    /// Commands of minds that are programs of their own, by robot.
    minds: BTreeMap<String, String>,
    /// Folder of what they print.
    pub logs: PathBuf,
}

impl Crew {
    /// Nobody yet.
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

    /// Starts an agent for that robot, the latest from now on; its process id.
    ///
    /// # Errors
    /// When it cannot be started.
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

    /// All of them, those that have been succeeded too.
    pub fn everybody(&mut self) -> impl Iterator<Item = &mut Process> {
        self.agents.iter_mut().chain(&mut self.former)
    }

    /// Tells the world what has become of them since, and people, unless the run is over.
    ///
    /// # Errors
    /// When the operating system does not know a process.
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
                    Change::Continued => say(&format!("{name} goes on")),
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
