//! What the launcher, which owns the process ids, tells the world about the agents' processes (DESIGN §3, key `process`).

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
}
