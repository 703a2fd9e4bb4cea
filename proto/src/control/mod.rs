//! Commands to a running mission, on the key `control` (DESIGN §3, §6), and its answers.
//!
//! Two forms of the same types ([`wire`]). Members of the run's own programs send bincode, sealed like every message
//! ([`crate::secret`]). Everybody else sends JSON with the encoding `application/json` and, as the attachment, the seal
//! [`crate::secret::Secret::mark_text`]: HMAC-SHA256 in hexadecimal, which any language can make. Answers come in the form of
//! the request. A put is obeyed without an answer, a query is answered. `docs/CONTROL.md` tells it to people.

#[cfg(test)]
mod tests;
pub mod wire;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Deserialize, Serialize};

use serde_json::{Value, json};

use crate::fault::{Fault, Order};
use crate::ids::{Incarnation, Tick};
use crate::mission::columns::ColumnValue;
use crate::time::SimTime;

/// JSON Schema (draft 2020-12) of a [`Request`], with that of a [`Reply`] under its key `reply`.
#[must_use]
pub fn schema() -> serde_json::Value {
    let mut generator = SchemaSettings::draft2020_12().into_generator();
    let reply = generator.subschema_for::<Reply>();
    let mut schema = generator.into_root_schema_for::<Request>();
    schema.insert("reply".to_owned(), reply.to_value());
    let mut schema = schema.to_value();
    if let Some(Value::Array(faults)) = schema.pointer_mut("/$defs/Fault/oneOf") {
        faults.push(json!({
            "description": "What only the mission knows.",
            "type": "object",
            "minProperties": 1,
            "maxProperties": 1,
            "propertyNames": { "not": { "enum": Fault::COMMON } },
            "additionalProperties": {
                "type": "object",
                "additionalProperties": { "type": "number" },
            },
        }));
    }
    schema
}

/// Somebody → world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Any text that no other request of the run has, 1 to 64 bytes without control characters: a request that is put again is
    /// ignored.
    pub nonce: String,
    /// What is asked for.
    pub command: ControlCommand,
}

/// What can be asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ControlCommand {
    /// Let this happen.
    Fault(Order),
    /// Heal the fault of that id, or disarm it; `null`: all of them.
    Clear(Option<String>),
    /// Which faults are there?
    List,
    /// How does the run go?
    Status,
    /// What is being run, and where is its log?
    Describe,
    /// The step clock; changes no byte of the run.
    Clock(ClockCommand),
}

/// Commands to the step clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ClockCommand {
    /// No further tick begins.
    Pause,
    /// The clock goes on.
    Resume,
    /// This many further ticks, then a pause.
    Step(u64),
    /// A multiple of real time, above 0; `null`: as fast as possible.
    Speed(Option<f64>),
}

/// World → who asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reply {
    /// The fault is armed.
    Armed(Armed),
    /// These faults are healed or disarmed.
    Cleared(Cleared),
    /// The run's faults, in the order in which they were armed.
    Faults(Vec<FaultStatus>),
    /// The run.
    Status(Box<Status>),
    /// What is being run.
    Description(Description),
    /// The clock does as it was told.
    Clock(ClockStatus),
    /// Nothing was done; what is wrong, and what would be right.
    Refused(String),
}

/// An armed fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Armed {
    /// The fault's id.
    pub id: String,
    /// Tick at which it takes effect; `null` if it waits for an event.
    pub tick: Option<Tick>,
    /// Simulated time of that tick.
    pub t_ms: Option<SimTime>,
}

/// Cleared faults.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Cleared {
    /// Their ids.
    pub ids: Vec<String>,
    /// Tick from which they are healed.
    pub tick: Tick,
    /// Simulated time of that tick.
    pub t_ms: SimTime,
}

/// A fault as the world sees it now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultStatus {
    /// Its id.
    pub id: String,
    /// What was ordered.
    pub order: Order,
    /// Where it stands.
    pub phase: Phase,
    /// When it last took effect.
    pub applied_ms: Option<SimTime>,
    /// When it last healed.
    pub healed_ms: Option<SimTime>,
    /// How often it has changed something: messages, ticks with a false reading or a disobeyed command, signals.
    pub hits: u64,
    /// Why it could not be done when it last should; `null` when it could.
    #[serde(default)]
    pub failed: Option<String>,
}

/// Where a fault stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// It waits for its trigger.
    Armed,
    /// It is in force.
    InForce,
    /// It is over.
    Over,
}

/// How a run goes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Status {
    /// Id of the run.
    pub run: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// The tick under way.
    pub tick: Tick,
    /// Its simulated time.
    pub t_ms: SimTime,
    /// The step clock.
    pub clock: ClockStatus,
    /// How far the mission has come: its columns of mission.csv.
    pub mission: Vec<ColumnValue>,
    /// The robots, by rank.
    pub robots: Vec<RobotStatus>,
    /// Faults that are armed or in force.
    pub faults: Vec<FaultStatus>,
}

/// What does not change during a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Description {
    /// Id of the run.
    pub run: String,
    /// Folder of its log, on the world's machine.
    pub folder: String,
    /// JSON text of `seed`, `scenario` as resolved, and `alliance`, as in run.json, but for the robots' own parameters.
    pub setup: String,
}

/// The step clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockStatus {
    /// Whether no further tick begins.
    pub paused: bool,
    /// Multiple of real time; `null`: as fast as possible.
    pub speed: Option<f64>,
    /// Ticks that a step command has left.
    pub steps_left: u64,
    /// The tick under way, or the next one.
    pub tick: Tick,
    /// For whom it waits, and what would help, once it has stood still for some seconds though nobody holds it.
    #[serde(default)]
    pub waits_for: Option<String>,
}

/// A robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotStatus {
    /// Its name.
    pub robot: String,
    /// Process id of its agent.
    pub pid: Option<u32>,
    /// Incarnation of its agent, if it has one.
    pub incarnation: Option<Incarnation>,
    /// What its agent is up to.
    pub state: AgentState,
    /// Center, m.
    pub x_m: f32,
    /// Center, m.
    pub y_m: f32,
    /// Heading, rad counter-clockwise from x.
    pub heading_rad: f32,
    /// Whether it carries an item.
    pub carrying: bool,
    /// Task of its active behavior set.
    pub task: Option<String>,
    /// Its behavior sets, in the order of the catalog.
    pub sets: Vec<SetStatus>,
}

/// What an agent is up to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AgentState {
    /// Its robot is not in the mission.
    Absent,
    /// There is none.
    Dead,
    /// It has been invited or is about to enter.
    Coming,
    /// It takes part.
    Present,
    /// It does not answer, or is stopped.
    Silent,
}

impl AgentState {
    /// In a word.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Absent => "absent",
            Self::Dead => "dead",
            Self::Coming => "coming",
            Self::Present => "present",
            Self::Silent => "silent",
        }
    }
}

/// A behavior set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SetStatus {
    /// Its name.
    pub behavior_set: String,
    /// Its motivation.
    pub motivation: f64,
    /// hibernating, waiting or active.
    pub state: String,
}
