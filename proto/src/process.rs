//! News from the launcher and orders from the world about the agents' processes (key `process`).

use serde::{Deserialize, Serialize};

/// Launcher → world: a change of a process. A liveliness token or a deadline would have the same effect later.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessNews {
    /// The running number of the launcher's news, from 1. The world ignores repetitions.
    pub number: u64,
    pub robot: String,
    pub pid: u32,
    pub state: ProcessState,
}

/// The state of a process as the operating system reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ProcessState {
    Stopped,
    Continued,
    /// Ended, for any reason.
    Ended,
}

/// World → launcher: an action on the process of a robot's agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessOrder {
    /// The running number of the world's orders, from 1. The launcher ignores repetitions.
    pub number: u64,
    pub robot: String,
    /// The process id that the agent sent to the world. The agent may have been started by hand.
    pub pid: Option<u32>,
    pub act: ProcessAction,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessAction {
    Start,
    Kill,
    Terminate,
    Stop,
    Continue,
}

impl ProcessAction {
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

/// Launcher → world: the answer to an order. For signals, success means that the operating system has confirmed the
/// effect.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessReply {
    pub number: u64,
    /// The process id, or the reason of the failure.
    pub result: Result<u32, String>,
}
