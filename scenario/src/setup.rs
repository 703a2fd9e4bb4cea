//! The complete setup of a run. In memory it contains data derived from the scenario, in JSON it does not.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value};

use super::alliance::{Alliance, RobotParams, StepOrder, SwitchSection};
use super::error::Problem;
use super::{Catalog, Profile, Roster, Scenario, Vocabulary};

/// The complete setup of a run: the world sends it to every agent and writes it to run.json.
///
/// The JSON form has `seed`, `scenario`, `alliance` and an optional `profile`. Reading it as a [`SetupFile`] derives
/// the rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// The seed of all random streams.
    pub seed: u64,
    /// The scenario with all defaults filled in.
    pub scenario: Scenario,
    pub alliance: Alliance,
    /// The times that robots learned in earlier runs.
    pub profile: Profile,
    /// The order in which robots step and receive broadcasts. In JSON it is `alliance.switches.step_order`.
    pub step_order: StepOrder,
    pub catalog: Arc<Catalog>,
    pub roster: Arc<Roster>,
}

/// The JSON form of a [`Setup`]. The reader supplies the known missions.
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
    /// The section states every switch.
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
                switches: SwitchSection::from_switches(self.alliance.switches, self.step_order),
                robots: Cow::Borrowed(&self.alliance.robots),
            },
            profile: &self.profile,
        }
        .serialize(serializer)
    }
}

// These functions are not generic, so serde's code for these types is compiled in this crate alone.
impl Setup {
    /// Returns the setup as JSON in one line.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }

    /// Reads the JSON of [`Setup::to_json`] without checks; see [`Setup::check`].
    ///
    /// # Errors
    /// Returns an error if the text is not JSON, or for the first value of the scenario that does not fit.
    pub fn from_json(text: &str, vocabulary: &Vocabulary) -> Result<Self, String> {
        let file: SetupFile = serde_json::from_str(text).map_err(|error| error.to_string())?;
        file.read(vocabulary).map_err(|error| error.to_string())
    }
}

impl SetupFile {
    /// Returns the setup without checks; see [`Setup::check`].
    pub fn read(self, vocabulary: &Vocabulary) -> Result<Setup, Problem> {
        let Self {
            seed,
            scenario,
            alliance,
            profile,
        } = self;
        let scenario = Scenario::from_json(scenario, vocabulary)
            .map_err(|problem| problem.under(["scenario"]))?;
        let catalog = Catalog::new(&scenario);
        profile
            .check(&scenario, &catalog, vocabulary)
            .map_err(|problem| problem.under(["profile"]))?;
        let preset = scenario.alliance.preset;
        let step_order = alliance.switches.step_order;
        Ok(Setup {
            seed,
            alliance: Alliance {
                threshold: alliance.threshold,
                step_ms: alliance.step_ms,
                switches: alliance.switches.applied_to(preset.switches()),
                robots: Arc::new(alliance.robots.into_owned()),
            },
            step_order: step_order.unwrap_or_else(|| scenario.step_order()),
            profile,
            catalog: Arc::new(catalog),
            roster: Arc::new(Roster::new(&scenario.robots)),
            scenario,
        })
    }
}
