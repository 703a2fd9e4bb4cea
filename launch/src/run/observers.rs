//! Processes that publish a run to other tools. The run continues without them.

use super::child_processes::{Ending, Process, ProcessChange};

/// The command of such a process.
#[derive(Clone, Debug)]
pub struct ObserverCommand {
    /// The name of the process.
    pub name: &'static str,
    /// The name of the other tool, for people.
    pub title: &'static str,
    /// The arguments of this program.
    pub arguments: Vec<String>,
    /// The address, for people.
    pub description: String,
}

impl ObserverCommand {
    /// Returns the name of the process's log. No robot can have it.
    #[must_use]
    pub fn log(&self) -> String {
        format!("{}.topics.log", self.name)
    }
}

/// Reports the state changes of a process without which the run continues. `name` begins its sentences. Returns whether
/// its failure has been reported.
pub(super) fn poll_observer(
    process: &mut Process,
    name: &str,
    over: bool,
    say: &dyn Fn(&str),
) -> anyhow::Result<bool> {
    while let Some(change) = process.poll()? {
        match change {
            ProcessChange::Stopped => say(&format!("{name} is stopped; the run continues")),
            ProcessChange::Continued => say(&format!("{name} resumes")),
            ProcessChange::Ended(ending) if ending != Ending::Exit(0) && !over => {
                say(&format!("{name} {}; the run continues", ending.describe()));
                if matches!(ending, Ending::Exit(_)) {
                    say(process.last_log_lines().trim_end());
                }
                return Ok(true);
            }
            ProcessChange::Ended(_) => {}
        }
    }
    Ok(false)
}
