//! A run as it is handed on: in memory with what follows from its scenario, in JSON without.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::alliance::{Alliance, RobotParams, StepOrder, SwitchSection};
use super::{Catalog, Roster, Scenario};

/// A run, complete: what the world sends to every agent and writes to run.json.
///
/// In JSON it has `seed`, `scenario` and `alliance`; whoever reads it works out the rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// Seed of all random streams.
    pub seed: u64,
    /// Scenario with all defaults filled in.
    pub scenario: Scenario,
    /// Every ALLIANCE value in force.
    pub alliance: Alliance,
    /// When robots step and hear each other. In JSON it is `alliance.switches.step_order`.
    pub step_order: StepOrder,
    /// The scenario's tasks and behavior sets.
    pub catalog: Arc<Catalog>,
    /// The scenario's robots.
    pub roster: Arc<Roster>,
}

/// The form in JSON.
#[derive(Serialize, Deserialize)]
struct SetupFile<'a> {
    seed: u64,
    scenario: Cow<'a, Scenario>,
    alliance: AllianceFile<'a>,
}

#[derive(Serialize, Deserialize)]
struct AllianceFile<'a> {
    threshold: f64,
    step_ms: u64,
    /// All of them are stated.
    switches: SwitchSection,
    robots: Cow<'a, BTreeMap<String, RobotParams>>,
}

impl Serialize for Setup {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        SetupFile {
            seed: self.seed,
            scenario: Cow::Borrowed(&self.scenario),
            alliance: AllianceFile {
                threshold: self.alliance.threshold,
                step_ms: self.alliance.step_ms,
                switches: SwitchSection::stating(self.alliance.switches, self.step_order),
                robots: Cow::Borrowed(&self.alliance.robots),
            },
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Setup {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let SetupFile {
            seed,
            scenario,
            alliance,
        } = SetupFile::deserialize(deserializer)?;
        let preset = scenario.alliance.preset;
        let step_order = alliance.switches.step_order;
        Ok(Self {
            seed,
            alliance: Alliance {
                threshold: alliance.threshold,
                step_ms: alliance.step_ms,
                switches: alliance.switches.over(preset.switches()),
                robots: alliance.robots.into_owned(),
            },
            step_order: step_order.unwrap_or_else(|| scenario.step_order()),
            catalog: Arc::new(Catalog::of(&scenario)),
            roster: Arc::new(Roster::of(&scenario.robots)),
            scenario: scenario.into_owned(),
        })
    }
}
