//! Processes that publish a run to other tools. The run continues without them.

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
