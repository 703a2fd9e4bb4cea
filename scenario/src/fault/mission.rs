//! Faults that a mission defines. They change its world instantly and do not heal.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// A fault that a mission defines. JSON and TOML write it like any other: `{"NAME": {"KEY": NUMBER, …}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissionFault {
    /// The name, unique among all faults.
    pub name: String,
    /// The stated arguments, by key.
    pub values: BTreeMap<String, FaultValue>,
}

/// The value of an argument.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FaultValue {
    Number(f64),
    /// The name of something in the scenario.
    Name(String),
}

impl fmt::Display for FaultValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Name(name) => name.fmt(f),
        }
    }
}

impl MissionFault {
    /// Creates a fault with this name and these values.
    #[must_use]
    pub fn new(name: &str, values: &[(&str, f64)]) -> Self {
        let values = values
            .iter()
            .map(|(key, value)| ((*key).to_owned(), FaultValue::Number(*value)));
        Self {
            name: name.to_owned(),
            values: values.collect(),
        }
    }

    /// Returns the fault with a name as an argument.
    #[must_use]
    pub fn with_name(mut self, key: &str, name: &str) -> Self {
        let value = FaultValue::Name(name.to_owned());
        self.values.insert(key.to_owned(), value);
        self
    }

    /// Returns the number of an argument if it is stated.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<f64> {
        match self.values.get(key)? {
            FaultValue::Number(number) => Some(*number),
            FaultValue::Name(_) => None,
        }
    }

    /// Returns the name in an argument if it is stated.
    #[must_use]
    pub fn get_name(&self, key: &str) -> Option<&str> {
        match self.values.get(key)? {
            FaultValue::Number(_) => None,
            FaultValue::Name(name) => Some(name),
        }
    }
}

/// Formats the arguments as on the command line.
impl fmt::Display for MissionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.values
            .iter()
            .try_for_each(|(key, value)| write!(f, " --{} {value}", key.replace('_', "-")))
    }
}
