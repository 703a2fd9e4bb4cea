//! run.json: what the run was and what came of it.

use std::collections::BTreeMap;

use crate::control::FaultStatus;
use crate::mission::MissionFigures;
use crate::scenario::{Setup, SetupFile, Vocabulary};
use crate::tick::Outcome;
use crate::time::SimTime;
use serde::{Deserialize, Serialize};

use super::level::LogLevel;

/// Contents of run.json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFile<S = Setup> {
    /// Version of the program that made the run.
    pub version: String,
    /// What the tables hold.
    pub log: LogLevel,
    /// Hash of the whole run, 16 hexadecimal digits; `None` while it is running.
    pub hash: Option<String>,
    /// How it ended.
    pub outcome: RunOutcome,
    /// Whether a stall or loss that the scenario did not ask for changed it.
    pub unscripted: bool,
    /// The run's faults at its end, with how often each has hit, in the order in which they were armed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<FaultStatus>,
    /// The minds that are programs of their own, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub minds: BTreeMap<String, MindFile>,
    /// Figures.
    pub result: Figures,
    /// `seed`, `scenario` as resolved, and `alliance`: every value that was in force.
    #[serde(flatten)]
    pub setup: S,
}

impl RunFile {
    /// As it stands in run.json.
    #[must_use]
    pub fn to_json(&self) -> String {
        let text = serde_json::to_string_pretty(self);
        // Every key is a string and the destination is memory, so nothing is left to fail.
        text.expect("run.json can be encoded") + "\n"
    }

    /// Reads run.json and checks it: whoever touched it may have broken anything, and what it holds is run again.
    ///
    /// # Errors
    /// One line: what is wrong, where, and what would be right.
    pub fn parse(text: &[u8], vocabulary: &Vocabulary) -> Result<Self, String> {
        let RunFile {
            version,
            log,
            hash,
            outcome,
            unscripted,
            faults,
            minds,
            result,
            setup,
        } = serde_json::from_slice::<RunFile<SetupFile>>(text)
            .map_err(|error| error.to_string().replace(char::is_control, " "))?;
        let setup = setup.read(vocabulary).map_err(|error| error.to_string())?;
        let run = Self {
            version,
            log,
            hash,
            outcome,
            unscripted,
            faults,
            minds,
            result,
            setup,
        };
        run.setup.check().map_err(|error| error.to_string())?;
        let scenario = &run.setup.scenario;
        let limit_ms = SimTime::from_secs_f64(scenario.limit_s).0;
        let most = limit_ms.div_ceil(scenario.step_ms);
        let ticks = run.result.ticks;
        if ticks > most {
            return Err(format!(
                "result.ticks: {ticks} is out of range; it must be at most {most}, for the run ends at limit_s"
            ));
        }
        Ok(run)
    }
}

/// What is known of a mind that is a program of its own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MindFile {
    /// What whoever gave its command calls its version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
}

/// How a run ended, if it did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunOutcome {
    /// Not yet, or the world was killed.
    Running,
    /// So.
    #[serde(untagged)]
    Ended(Outcome),
}

/// Result figures of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Number of ticks.
    pub ticks: u64,
    /// Simulated time at the end of the last tick, ms.
    pub sim_time_ms: SimTime,
    /// Those of the mission.
    #[serde(flatten)]
    pub mission: MissionFigures,
    /// By robot name.
    pub robots: BTreeMap<String, RobotFigures>,
}

/// One robot's result figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotFigures {
    /// Lives of its agent.
    pub lives: u32,
    /// Ticks in which a report of it counted.
    pub ticks_counted: u64,
    /// Times that a behavior set became active.
    pub activations: u32,
    /// Those of the mission.
    #[serde(flatten)]
    pub mission: MissionFigures,
    /// Broadcasts sent.
    pub messages_sent: u64,
    /// Their payloads together, each once: encoded and sealed, without what zenoh and TCP add.
    pub bytes_sent: u64,
    /// Broadcasts of teammates heard.
    pub messages_heard: u64,
    /// Broadcasts of teammates that were not heard: really lost, or dropped or cut off by a fault.
    pub messages_lost: u64,
    /// Those of the heard ones that came late, for a fault delayed them; absent: none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub messages_delayed: u64,
    /// Second copies, ignored; absent: none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub messages_duplicate: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}
