//! Faults that only a mission knows. They change its world in a moment, and do not heal.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// A fault of a mission's own, by the name that the mission gives it. In JSON and TOML it reads like any other:
/// `{"NAME": {"KEY": NUMBER, …}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissionFault {
    /// Its name.
    pub name: String,
    /// What is stated of it, by key.
    pub values: BTreeMap<String, f64>,
}

impl MissionFault {
    /// The fault of that name with those values.
    #[must_use]
    pub fn new(name: &str, values: &[(&str, f64)]) -> Self {
        let values = values
            .iter()
            .map(|(key, value)| ((*key).to_owned(), *value));
        Self {
            name: name.to_owned(),
            values: values.collect(),
        }
    }

    /// What is stated under that key.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<f64> {
        self.values.get(key).copied()
    }
}

/// As the command line takes it.
impl fmt::Display for MissionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.values
            .iter()
            .try_for_each(|(key, value)| write!(f, " --{} {value}", key.replace('_', "-")))
    }
}

/// What can be stated of a fault of a mission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSpec {
    /// Its name: a word of its own among all faults.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    /// What is to be stated of it, and after that what may be left out.
    pub arguments: &'static [FaultArgument],
}

/// A number that is stated of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultArgument {
    /// Its key, which ends with its unit.
    pub key: &'static str,
    /// What it means, in a line.
    pub about: &'static str,
    /// What it may be.
    pub range: FaultRange,
    /// What it is if it is left out; `None`: it must be stated.
    pub default: Option<f64>,
}

/// What a number of a fault may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultRange {
    /// A place inside the border along x, m.
    X,
    /// A place inside the border along y, m.
    Y,
    /// A whole number from the first to the second.
    Whole(u32, u32),
    /// A number from the first to the second.
    Within(f64, f64),
}
