//! The state of a process according to the operating system.

use std::fs;

use nix::unistd::getppid;

/// The environment variable with the process id of the launcher. A child process ends together with its launcher.
pub const LAUNCHER: &str = "ALLIANCE_LAUNCHER";

/// Returns whether a launcher started this process and still runs.
#[must_use]
pub fn has_launcher() -> bool {
    std::env::var(LAUNCHER).is_ok_and(|launcher| launcher == getppid().to_string())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OsProcess {
    /// `true` if a signal has stopped the process.
    pub is_stopped: bool,
    /// The start time, in clock ticks since the machine started. Together with the id it distinguishes processes that
    /// reuse an id.
    pub started: u64,
}

impl OsProcess {
    /// Returns the process with this id, unless it has ended.
    #[must_use]
    pub fn find(pid: u32) -> Option<Self> {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        // The name is in parentheses and can contain any character. The state is the next field, and the start time the
        // 19th after that.
        let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
        let state = fields.next()?;
        let started = fields.nth(18)?.parse().ok()?;
        (!matches!(state, "Z" | "X")).then_some(Self {
            is_stopped: matches!(state, "T" | "t"),
            started,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::process::{Command, id};

    use super::*;

    #[test]
    fn a_process_is_found_until_it_ends() {
        let this = OsProcess::find(id()).unwrap();
        assert!(!this.is_stopped);
        let mut child = Command::new("sleep").arg("60").spawn().unwrap();
        let other = OsProcess::find(child.id()).unwrap();
        assert!(other.started >= this.started);
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(OsProcess::find(child.id()), None);
    }
}
