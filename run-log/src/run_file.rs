//! run.json: the description and the results of a run.

use std::collections::BTreeMap;

use proto::control::FaultStatus;
use proto::tick::Outcome;
use scenario::ids::Tick;
use scenario::mission::MissionFigures;
use scenario::mission::columns::ColumnValue;
use scenario::time::SimTime;
use scenario::{Setup, SetupFile, Vocabulary};
use serde::{Deserialize, Serialize};

use super::level::LogLevel;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFile<S = Setup> {
    /// The version of the program that made the run.
    pub version: String,
    /// The identity of the world's build; empty if it is not known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub build: String,
    /// The builds of agents that differ from the world's, by robot. They can decide otherwise than the world's program.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub agent_builds: BTreeMap<String, String>,
    pub log: LogLevel,
    /// The hash of the whole run, 16 hexadecimal digits; `None` while the run is in progress.
    pub hash: Option<String>,
    pub outcome: RunOutcome,
    /// The origin of a branch; absent for a run of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub branch: Option<BranchOrigin>,
    /// `true` if an unscripted stall or message loss changed the run, or bodies of another world took part.
    pub unscripted: bool,
    /// The faults at the end of the run with their hit counts, in the order in which they were armed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<FaultStatus>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub controllers: BTreeMap<String, ControllerFile>,
    pub result: Figures,
    /// The keys `seed`, `scenario` (as resolved) and `alliance`: all values in force.
    #[serde(flatten)]
    pub setup: S,
}

impl RunFile {
    #[must_use]
    pub fn to_json(&self) -> String {
        let text = serde_json::to_string_pretty(self);
        // All keys are strings and the target is memory, so serialization cannot fail.
        text.expect("run.json can be encoded") + "\n"
    }

    /// Returns the columns of the mission with their values at the end of the run.
    #[must_use]
    pub fn mission_row(&self) -> Vec<ColumnValue> {
        let columns = self.setup.catalog.mission.vocabulary().columns.iter();
        let figures = &self.result.mission;
        let row =
            columns.filter_map(|column| Some(column.with_value(figures.column(column.name)?)));
        row.collect()
    }

    /// Parses run.json and validates it. A replay uses its contents, and users can edit the file.
    ///
    /// # Errors
    /// Returns one line with the position, the problem and the remedy.
    pub fn parse(text: &[u8], vocabulary: &Vocabulary) -> Result<Self, String> {
        let RunFile {
            version,
            build,
            agent_builds,
            log,
            hash,
            outcome,
            branch,
            unscripted,
            faults,
            controllers,
            result,
            setup,
        } = serde_json::from_slice::<RunFile<SetupFile>>(text)
            .map_err(|error| error.to_string().replace(char::is_control, " "))?;
        let setup = setup.read(vocabulary).map_err(|error| error.to_string())?;
        let run = Self {
            version,
            build,
            agent_builds,
            log,
            hash,
            outcome,
            branch,
            unscripted,
            faults,
            controllers,
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
                "result.ticks: {ticks} is out of range; it must be at most {most} because the run ends at limit_s"
            ));
        }
        Ok(run)
    }
}

/// The run that a branch repeats up to a tick. A replay does not need that run: the inputs of the branch contain all.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BranchOrigin {
    /// The folder of the repeated run.
    pub run: String,
    /// The hash of the repeated run, 16 hexadecimal digits.
    pub hash: String,
    /// The first tick that the changes can affect.
    pub tick: Tick,
    /// The simulated time at the start of that tick, ms.
    pub t_ms: SimTime,
}

/// The recorded facts about an external controller.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControllerFile {
    /// The version as stated together with the controller's command.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
}

/// The state of a run: in progress, or ended with an outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunOutcome {
    /// The run is in progress, or its world was killed.
    Running,
    #[serde(untagged)]
    Ended(Outcome),
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    pub ticks: u64,
    /// The simulated time at the end of the last tick, ms.
    pub sim_time_ms: SimTime,
    #[serde(flatten)]
    pub mission: MissionFigures,
    pub robots: BTreeMap<String, RobotFigures>,
}

/// The result figures of one robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotFigures {
    /// The number of incarnations of its agent.
    pub incarnations: u32,
    /// The number of ticks in which a report of the robot counted.
    pub ticks_counted: u64,
    /// The number of times that a behavior set became active.
    pub activations: u32,
    #[serde(flatten)]
    pub mission: MissionFigures,
    /// The number of broadcasts sent.
    pub messages_sent: u64,
    /// Their total payload, bytes, encoded and sealed, without the overhead of zenoh and TCP.
    pub bytes_sent: u64,
    /// The number of received teammates' broadcasts.
    pub messages_received: u64,
    /// The number of teammates' broadcasts that were lost, dropped or cut.
    pub messages_lost: u64,
    /// The number of received broadcasts that a fault delayed; absent for 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub messages_delayed: u64,
    /// The number of second copies, which are ignored; absent for 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub messages_duplicate: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}
