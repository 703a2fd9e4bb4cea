//! The settings of a parameter search.

use std::collections::BTreeMap;

use scenario::{KeyPath, Problem};
use serde::Deserialize;

use super::leaves::{Leaf, leaves_below};
use super::seeds::Seeds;
use super::space::Range;

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchSettings {
    /// The name of the metric to optimize; by default the measure that ranks the runs of the missions.
    #[serde(default)]
    pub metric: Option<String>,
    /// The weight of the sent bytes in the score; 0 ignores them.
    #[serde(default)]
    pub bytes_weight: f64,
    /// The approximate number of runs per allocator and method. The last generation always completes.
    pub budget: usize,
    #[serde(default = "one")]
    pub seed: u64,
    /// The largest number of seeds per candidate.
    #[serde(default = "four")]
    pub seeds_per_candidate: usize,
    pub training: Seeds,
    /// The seeds that select the winner among the finalists; they remove lucky candidates.
    pub selection: Seeds,
    /// The number of finalists per method.
    #[serde(default = "five")]
    pub finalists: usize,
    /// The seeds that judge the result.
    pub test: Seeds,
    /// Classes of faults that only the test uses.
    #[serde(default)]
    pub unseen: Vec<String>,
    /// The bounds of each key, by allocator.
    pub parameters: BTreeMap<String, toml::Table>,
}

impl SearchSettings {
    /// Returns the bounds of an allocator's keys. The table may be nested or have dotted keys.
    ///
    /// # Errors
    /// Returns the key whose bounds cannot be read, and the problem.
    pub fn ranges(&self, allocator: &str) -> Result<Vec<(String, Range)>, Problem> {
        let table = self.parameters.get(allocator).cloned().unwrap_or_default();
        let is_range = |table: &toml::Table| table.contains_key("from") || table.contains_key("to");
        let mut found = Vec::new();
        for Leaf { path, value, .. } in leaves_below(&KeyPath::default(), &[], table, is_range) {
            let key = path.join(".");
            let range: Result<Range, _> = value.try_into();
            let range = range.map_err(|error: toml::de::Error| {
                let at = KeyPath::verbatim(&key);
                Problem::at(at, error.message(), "write { from = 1.0, to = 10.0 }")
            })?;
            found.push((key, range));
        }
        // A parameter that is a multiple of another one comes after it.
        found.sort_by_key(|(_, range)| range.times.is_some());
        Ok(found)
    }
}

const fn one() -> u64 {
    1
}

const fn four() -> usize {
    4
}

const fn five() -> usize {
    5
}
