//! A condition of the study, and a rule that is tried under it.

use std::fmt;

use serde::Deserialize;

/// A team with its tasks, and a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    pub robots: usize,
    pub tasks: usize,
    /// The number of robots that can do each task.
    pub coverage: usize,
    /// h, the spread of times and powers.
    pub spread: f64,
    pub fault: TrialFault,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrialFault {
    None,
    /// The first robot is killed at 60 s.
    Crash,
    /// The first robot takes three times as long as its teammates expect.
    Slow,
}

/// The rule by which robots choose tasks.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Rule {
    pub name: String,
    /// The values of `[allocators.l-alliance]`.
    #[serde(flatten)]
    pub parameters: toml::Table,
}

impl Rule {
    /// Returns the rule's lines of `[allocators.l-alliance]`.
    pub(super) fn lines(&self) -> String {
        self.parameters.to_string()
    }
}

impl TrialFault {
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Crash => "r0 dies at 60 s",
            Self::Slow => "r0 is three times slower",
        }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            robots,
            tasks,
            coverage,
            spread,
            fault,
        } = self;
        write!(f, "({robots},{tasks},{coverage}), {spread}")?;
        match fault {
            TrialFault::None => Ok(()),
            fault => write!(f, ", {}", fault.as_str()),
        }
    }
}
