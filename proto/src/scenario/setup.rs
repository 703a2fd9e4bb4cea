//! A run as it is handed on: in memory with what follows from its scenario, in JSON without.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value};

use super::alliance::{Alliance, RobotParams, StepOrder, SwitchSection};
use super::error::ScenarioError;
use super::{Catalog, Profile, Roster, Scenario, Vocabulary};

/// A run, complete: what the world sends to every agent and writes to run.json.
///
/// In JSON it has `seed`, `scenario`, `alliance` and, where there is one, `profile`; whoever reads it, as a [`SetupFile`], works out the rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// Seed of all random streams.
    pub seed: u64,
    /// Scenario with all defaults filled in.
    pub scenario: Scenario,
    /// Every ALLIANCE value in force.
    pub alliance: Alliance,
    /// What robots have learned in earlier runs.
    pub profile: Profile,
    /// When robots step and hear each other. In JSON it is `alliance.switches.step_order`.
    pub step_order: StepOrder,
    /// The scenario's tasks and behavior sets.
    pub catalog: Arc<Catalog>,
    /// The scenario's robots.
    pub roster: Arc<Roster>,
}

/// A [`Setup`] as it stands in JSON: which missions there are is told by whoever reads it.
#[derive(Clone, Debug, Deserialize)]
pub struct SetupFile {
    seed: u64,
    scenario: Map<String, Value>,
    alliance: AllianceFile<'static>,
    #[serde(default)]
    profile: Profile,
}

#[derive(Serialize)]
struct Written<'a> {
    seed: u64,
    scenario: &'a Scenario,
    alliance: AllianceFile<'a>,
    #[serde(skip_serializing_if = "Profile::is_empty")]
    profile: &'a Profile,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct AllianceFile<'a> {
    threshold: f64,
    step_ms: u64,
    /// All of them are stated.
    switches: SwitchSection,
    robots: Cow<'a, BTreeMap<String, RobotParams>>,
}

impl Serialize for Setup {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Written {
            seed: self.seed,
            scenario: &self.scenario,
            alliance: AllianceFile {
                threshold: self.alliance.threshold,
                step_ms: self.alliance.step_ms,
                switches: SwitchSection::stating(self.alliance.switches, self.step_order),
                robots: Cow::Borrowed(&self.alliance.robots),
            },
            profile: &self.profile,
        }
        .serialize(serializer)
    }
}

// Not generic, so that the code that serde makes for these types is compiled in this crate alone.
impl Setup {
    /// As JSON, in one line.
    ///
    /// # Errors
    /// When a section of a mission cannot be written.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }

    /// What [`Setup::to_json`] has made, not checked: see [`Setup::check`].
    ///
    /// # Errors
    /// Where it is no JSON, or the first value of the scenario that does not fit.
    pub fn from_json(text: &str, vocabulary: &Vocabulary) -> Result<Self, String> {
        let file: SetupFile = serde_json::from_str(text).map_err(|error| error.to_string())?;
        file.read(vocabulary).map_err(|error| error.to_string())
    }
}

impl SetupFile {
    /// The setup, not checked: see [`Setup::check`].
    ///
    /// # Errors
    /// The first value of the scenario that does not fit.
    pub fn read(self, vocabulary: &Vocabulary) -> Result<Setup, ScenarioError> {
        let Self {
            seed,
            scenario,
            alliance,
            profile,
        } = self;
        let scenario = Scenario::from_json(scenario, vocabulary)
            .map_err(|problem| problem.below("scenario").located(None))?;
        let catalog = Catalog::of(&scenario);
        profile
            .check(&scenario, &catalog, vocabulary)
            .map_err(|problem| problem.below("profile").located(None))?;
        let preset = scenario.alliance.preset;
        let step_order = alliance.switches.step_order;
        Ok(Setup {
            seed,
            alliance: Alliance {
                threshold: alliance.threshold,
                step_ms: alliance.step_ms,
                switches: alliance.switches.over(preset.switches()),
                robots: alliance.robots.into_owned(),
            },
            step_order: step_order.unwrap_or_else(|| scenario.step_order()),
            profile,
            catalog: Arc::new(catalog),
            roster: Arc::new(Roster::of(&scenario.robots)),
            scenario,
        })
    }
}
