//! What is to be tuned, and by what.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::file::Seeds;
use crate::tune::space::Range;

/// The table `tune`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// What is to be little, or much where that is better.
    #[serde(default = "metric")]
    pub metric: String,
    /// How much the bytes that are sent count beside it.
    #[serde(default)]
    pub bytes_weight: f64,
    /// Runs of each allocator by each method, about: the last generation is finished.
    pub budget: usize,
    /// Of the search.
    #[serde(default = "one")]
    pub seed: u64,
    /// Seeds that a candidate has at most.
    #[serde(default = "four")]
    pub seeds_per_candidate: usize,
    /// From which those of a generation are taken in turn.
    pub training: Seeds,
    /// By which the best of the search are told from the lucky ones.
    pub selection: Seeds,
    /// How many of each method come that far.
    #[serde(default = "five")]
    pub finalists: usize,
    /// By which the result is judged.
    pub test: Seeds,
    /// Classes of faults that only the test has.
    #[serde(default)]
    pub unseen: Vec<String>,
    /// By allocator, the bounds of each key.
    pub parameters: BTreeMap<String, toml::Table>,
}

impl Tuning {
    /// The bounds of an allocator's keys, by key, as the table has them: nested, or with dots.
    ///
    /// # Errors
    /// The key whose bounds cannot be read, and why.
    pub fn ranges(&self, allocator: &str) -> Result<Vec<(String, Range)>, (String, String)> {
        fn collect(
            way: &str,
            table: &toml::Table,
            found: &mut Vec<(String, Range)>,
        ) -> Result<(), (String, String)> {
            for (name, value) in table {
                let key = if way.is_empty() {
                    name.clone()
                } else {
                    format!("{way}.{name}")
                };
                match value {
                    toml::Value::Table(below)
                        if !["from", "to"].iter().any(|it| below.contains_key(*it)) =>
                    {
                        collect(&key, below, found)?;
                    }
                    value => {
                        let range = value.clone().try_into();
                        let range = range.map_err(|error: toml::de::Error| {
                            let said = error.message().to_owned();
                            (
                                key.clone(),
                                format!("{said}; write {{ from = 1.0, to = 10.0 }}"),
                            )
                        })?;
                        found.push((key, range));
                    }
                }
            }
            Ok(())
        }
        let mut found = Vec::new();
        if let Some(table) = self.parameters.get(allocator) {
            collect("", table, &mut found)?;
        }
        // One that is a multiple comes after what it is a multiple of.
        found.sort_by_key(|(_, range)| range.times.is_some());
        Ok(found)
    }
}

fn metric() -> String {
    "par2_s".to_owned()
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
