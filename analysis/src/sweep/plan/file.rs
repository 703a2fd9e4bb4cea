//! The format of a plan file.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use scenario::Preset;
use scenario::fault::{Order, RandomFaults};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::hypothesis::Claim;
use super::seeds::Seeds;
use super::tuning::SearchSettings;
use crate::random_mission::RandomMission;

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct PlanFile {
    pub(super) scenario: Option<Source>,
    pub(super) limit_s: Option<f64>,
    pub(super) seeds: Seeds,
    pub(super) presets: Vec<Preset>,
    pub(super) faults: BTreeMap<String, FaultClass>,
    pub(super) grid: toml::Table,
    pub(super) list: Vec<toml::Table>,
    pub(super) random: Option<toml::Table>,
    pub(super) random_mission: RandomMission,
    /// The properties that are drawn for each seed: `start`, `layout`.
    pub(super) randomise: Vec<String>,
    pub(super) check: bool,
    pub(super) missions: BTreeMap<String, MissionFile>,
    pub(super) question: Option<String>,
    pub(super) best_known: Option<PathBuf>,
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
    /// The primary metric, in place of the one that the scenario declares.
    pub(super) metric: Option<String>,
    /// Scenario keys with other values.
    pub(super) set: toml::Table,
    /// Classes of faults by name; they replace those for all missions.
    pub(super) faults: BTreeMap<String, FaultClass>,
}

/// A class of faults.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct FaultClass {
    pub(super) timeline: Vec<Order>,
    pub(super) random: Option<RandomFaults>,
    /// Scenario keys with other values, such as those of the radio channel.
    pub(super) set: toml::Table,
}

/// The scenario of a plan: a name or file, or the table `scenario` of the plan itself.
pub(crate) enum Source {
    Named(String),
    Inline,
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
