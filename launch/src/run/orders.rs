//! Execution of the world's process orders with signals. An order is answered when its signal has taken effect.

use std::time::Duration;

use anyhow::{Context, bail};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use proto::process::{ProcessAction, ProcessOrder};
use tokio::time::{Instant, sleep};

use super::child_processes::Process;
use super::crew::AgentProcesses;

/// The maximum time until a signal takes effect.
const PATIENCE: Duration = Duration::from_secs(10);

/// The interval between checks of a process state.
const GLANCE: Duration = Duration::from_millis(1);

impl AgentProcesses {
    /// Executes an order of the world and returns the process id.
    ///
    /// # Errors
    /// If the signal cannot be sent or does not take effect.
    pub async fn execute(&mut self, order: &ProcessOrder) -> anyhow::Result<u32> {
        if order.act == ProcessAction::Start {
            return self.start(&order.robot);
        }
        let signal = match order.act {
            ProcessAction::Kill => Signal::SIGKILL,
            ProcessAction::Terminate => Signal::SIGTERM,
            ProcessAction::Stop => Signal::SIGSTOP,
            ProcessAction::Continue | ProcessAction::Start => Signal::SIGCONT,
        };
        let Some(pid) = order.pid else {
            bail!("the process of {} is not known", order.robot);
        };
        match self.agents.iter_mut().find(|agent| agent.pid() == pid) {
            Some(agent) => {
                // A stopped process receives SIGTERM only after SIGCONT.
                let needs_resume = order.act == ProcessAction::Terminate && agent.is_stopped();
                agent.signal(signal);
                if needs_resume {
                    agent.signal(Signal::SIGCONT);
                }
                let wanted = match order.act {
                    ProcessAction::Stop => true,
                    ProcessAction::Continue => false,
                    // The world detects the end by the agent's liveliness token.
                    _ => return Ok(pid),
                };
                wait_for_child(agent, wanted).await?;
            }
            None => {
                let process = Pid::from_raw(i32::try_from(pid).context("process id")?);
                kill(process, signal).with_context(|| format!("process {pid}"))?;
                match order.act {
                    ProcessAction::Stop => wait_for_other(pid, true).await?,
                    ProcessAction::Continue => wait_for_other(pid, false).await?,
                    _ => {}
                }
            }
        }
        Ok(pid)
    }
}

/// Waits until a child of the launcher is stopped or resumed. The change is not reported, because the world ordered it.
async fn wait_for_child(agent: &mut Process, stopped: bool) -> anyhow::Result<()> {
    let until = Instant::now() + PATIENCE;
    while agent.is_stopped() != stopped {
        agent.poll()?;
        if let Some(ending) = agent.ending() {
            bail!("{} {}", agent.name(), ending.describe());
        }
        if Instant::now() > until {
            bail!("{} does not obey the signal", agent.name());
        }
        if agent.is_stopped() != stopped {
            sleep(GLANCE).await;
        }
    }
    Ok(())
}

/// Waits until a process that is no child of the launcher is stopped or resumed.
async fn wait_for_other(pid: u32, stopped: bool) -> anyhow::Result<()> {
    let until = Instant::now() + PATIENCE;
    loop {
        let path = format!("/proc/{pid}/stat");
        let stat = std::fs::read_to_string(&path).with_context(|| path)?;
        // The format is "PID (NAME) STATE …"; the name may contain spaces and parentheses.
        let state = stat
            .rsplit(')')
            .next()
            .and_then(|rest| rest.trim().chars().next());
        if (state == Some('T')) == stopped {
            return Ok(());
        }
        if Instant::now() > until {
            bail!("process {pid} does not obey the signal");
        }
        sleep(GLANCE).await;
    }
}
