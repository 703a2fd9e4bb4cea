//! The agents' processes, which the launcher owns (DESIGN §3, key `process`): what it tells the world of them, and what the
//! world asks it to do to them.

use serde::{Deserialize, Serialize};

/// Launcher → world. Decides nothing that a token or a deadline would not decide as well, only sooner.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessNews {
    /// Running number of the launcher's news, from 1: what is put again later is no news.
    pub number: u64,
    /// Name of the robot.
    pub robot: String,
    /// Process id of its agent.
    pub pid: u32,
    /// What happened to it.
    pub state: ProcessState,
}

/// State of a process as the operating system reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ProcessState {
    /// Stopped by a signal.
    Stopped,
    /// Continued by SIGCONT.
    Continued,
    /// Ended, however.
    Ended,
}

/// World → launcher: do this to the process of a robot's agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessOrder {
    /// Running number of the world's orders, from 1: one that is put again is ignored.
    pub number: u64,
    /// Name of the robot.
    pub robot: String,
    /// Process id of its agent, as it told the world: it may have been started by hand.
    pub pid: Option<u32>,
    /// What to do.
    pub act: ProcessAct,
}

/// What can be done to a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessAct {
    /// Start one.
    Start,
    /// SIGKILL.
    Kill,
    /// SIGTERM.
    Terminate,
    /// SIGSTOP.
    Stop,
    /// SIGCONT.
    Continue,
}

impl ProcessAct {
    /// As an order names it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Kill => "kill",
            Self::Terminate => "terminate",
            Self::Stop => "stop",
            Self::Continue => "continue",
        }
    }
}

/// Launcher → world, the answer: done, which of a signal means that the operating system has seen it take effect, or not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessReply {
    /// Number of the order.
    pub number: u64,
    /// The process id, or why it could not be done.
    pub result: Result<u32, String>,
}
