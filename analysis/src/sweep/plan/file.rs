//! The format of a plan file.

use std::collections::BTreeMap;
use std::fmt;

use scenario::Preset;
use scenario::fault::Faults;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::MAX_RUNS;
use super::hypothesis::Claim;
use super::tuning::SearchSettings;
use crate::random_mission::RandomMission;

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct PlanFile {
    pub(super) scenario: Option<Source>,
    pub(super) limit_s: Option<f64>,
    pub(super) seeds: Seeds,
    pub(super) presets: Vec<Preset>,
    pub(super) faults: BTreeMap<String, Faults>,
    pub(super) grid: toml::Table,
    pub(super) list: Vec<toml::Table>,
    pub(super) random: Option<toml::Table>,
    pub(super) random_mission: RandomMission,
    pub(super) check: bool,
    pub(super) missions: BTreeMap<String, MissionFile>,
    pub(super) question: Option<String>,
    pub(super) hypotheses: BTreeMap<String, Claim>,
    pub(super) tune: Option<SearchSettings>,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct MissionFile {
    /// A name or a file.
    pub(super) scenario: Option<String>,
    /// The number of robots, for a mission that can be scaled.
    pub(super) robots: Option<usize>,
    /// The amount of work, for a mission that can be scaled.
    pub(super) size: Option<usize>,
    /// Scenario keys with other values.
    pub(super) set: toml::Table,
    /// Classes of faults by name; they replace those for all missions.
    pub(super) faults: BTreeMap<String, Faults>,
}

/// The scenario of a plan: a name or file, or the table `scenario` of the plan itself.
pub(super) enum Source {
    Named(String),
    Inline,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Seeds(pub Vec<i64>);

impl Default for Seeds {
    fn default() -> Self {
        Self(vec![1])
    }
}

impl<'de> Deserialize<'de> for Source {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Form;
        impl<'de> Visitor<'de> for Form {
            type Value = Source;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the name of a built-in scenario, a file, or the scenario itself as a table",
                )
            }
            fn visit_str<E: Error>(self, name: &str) -> Result<Source, E> {
                Ok(Source::Named(name.to_owned()))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Source, A::Error> {
                IgnoredAny::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Source::Inline)
            }
        }
        deserializer.deserialize_any(Form)
    }
}

impl<'de> Deserialize<'de> for Seeds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct FromTo {
            from: i64,
            to: i64,
        }
        struct Form;
        impl Form {
            fn range<E: Error>(from: i64, to: i64) -> Result<Seeds, E> {
                // The bound also limits the number of runs.
                if 0 <= from && from <= to && to - from < MAX_RUNS as i64 {
                    Ok(Seeds((from..=to).collect()))
                } else {
                    Err(E::custom(format!(
                        "the range of seeds {from} to {to} is empty, negative or too long"
                    )))
                }
            }
        }
        impl<'de> Visitor<'de> for Form {
            type Value = Seeds;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of seeds, { from = …, to = … }, or a list of seeds")
            }
            fn visit_i64<E: Error>(self, count: i64) -> Result<Seeds, E> {
                Self::range(1, count)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Seeds, A::Error> {
                let mut seeds = Vec::new();
                while let Some(seed) = sequence.next_element()? {
                    Self::range::<A::Error>(seed, seed)?;
                    seeds.push(seed);
                }
                Ok(Seeds(seeds))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Seeds, A::Error> {
                let FromTo { from, to } = FromTo::deserialize(MapAccessDeserializer::new(map))?;
                Self::range(from, to)
            }
        }
        deserializer.deserialize_any(Form)
    }
}
