//! What the world asks to be done to agents' processes: with real signals, answered when the operating system has seen them
//! take effect.

use std::time::Duration;

use alliance_proto::process::{ProcessAct, ProcessOrder};
use anyhow::{Context, bail};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tokio::time::{Instant, sleep};

use super::children::Process;
use super::crew::Crew;

/// How long a signal may take to be seen to have taken effect.
const PATIENCE: Duration = Duration::from_secs(10);

/// How often that is looked at.
const GLANCE: Duration = Duration::from_millis(1);

impl Crew {
    /// Does what the world asks for; the process id.
    ///
    /// # Errors
    /// Why it cannot be done.
    pub async fn obey(&mut self, order: &ProcessOrder) -> anyhow::Result<u32> {
        if order.act == ProcessAct::Start {
            return self.start(&order.robot);
        }
        let signal = match order.act {
            ProcessAct::Kill => Signal::SIGKILL,
            ProcessAct::Terminate => Signal::SIGTERM,
            ProcessAct::Stop => Signal::SIGSTOP,
            ProcessAct::Continue | ProcessAct::Start => Signal::SIGCONT,
        };
        let Some(pid) = order.pid else {
            bail!("the process of {} is not known", order.robot);
        };
        match self.agents.iter_mut().find(|agent| agent.pid() == pid) {
            Some(agent) => {
                // A stopped process would get SIGTERM only when it goes on.
                let woken = order.act == ProcessAct::Terminate && agent.is_stopped();
                agent.signal(signal);
                if woken {
                    agent.signal(Signal::SIGCONT);
                }
                let wanted = match order.act {
                    ProcessAct::Stop => true,
                    ProcessAct::Continue => false,
                    // Its token tells when it has died.
                    _ => return Ok(pid),
                };
                see_own(agent, wanted).await?;
            }
            None => {
                let process = Pid::from_raw(i32::try_from(pid).context("process id")?);
                kill(process, signal).with_context(|| format!("process {pid}"))?;
                match order.act {
                    ProcessAct::Stop => see_other(pid, true).await?,
                    ProcessAct::Continue => see_other(pid, false).await?,
                    _ => {}
                }
            }
        }
        Ok(pid)
    }
}

/// Waits until a process of the launcher's own is stopped, or goes on. The world has asked for it: it needs no news of it.
async fn see_own(agent: &mut Process, stopped: bool) -> anyhow::Result<()> {
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

/// The same of a process that somebody else started.
async fn see_other(pid: u32, stopped: bool) -> anyhow::Result<()> {
    let until = Instant::now() + PATIENCE;
    loop {
        let path = format!("/proc/{pid}/stat");
        let stat = std::fs::read_to_string(&path).with_context(|| path)?;
        // "PID (NAME) STATE …", and the name may hold anything.
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
