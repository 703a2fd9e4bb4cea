//! What the operating system says of a process.

use std::fs;

/// Environment variable that tells a child which process started it, with which it is to end.
pub const LAUNCHER: &str = "ALLIANCE_LAUNCHER";

/// A process that there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OsProcess {
    /// Whether a signal has stopped it.
    pub is_stopped: bool,
    /// When it started, clock ticks since the machine did: with the id, this tells it from an earlier process of the same id.
    pub started: u64,
}

impl OsProcess {
    /// The process of that id, unless it has ended.
    #[must_use]
    pub fn of(pid: u32) -> Option<Self> {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        // The name, in brackets, may hold anything; the state is the field after it, and the start the nineteenth after that.
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
    fn a_process_is_known_by_its_id_and_its_start() {
        let me = OsProcess::of(id()).unwrap();
        assert!(!me.is_stopped);
        let mut child = Command::new("sleep").arg("60").spawn().unwrap();
        let other = OsProcess::of(child.id()).unwrap();
        assert!(other.started >= me.started);
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(OsProcess::of(child.id()), None);
    }
}
