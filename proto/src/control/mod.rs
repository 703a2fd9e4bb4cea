//! Commands to a running mission on the key `control`, and the replies.
//!
//! The types have two encodings ([`wire`]). Programs of the run send bincode, sealed like every message
//! ([`crate::secret`]). Other clients send JSON with the encoding `application/json`. Their attachment is the seal
//! [`crate::secret::Secret::mark_text`]: HMAC-SHA256 in hexadecimal, available in any language. A reply has the
//! encoding of its request. A put gets no reply; a query gets one. `docs/CONTROL.md` documents the topic.

#[cfg(test)]
mod tests;
pub mod wire;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Deserialize, Serialize};

use serde_json::{Value, json};

use scenario::fault::{Fault, Order};
use scenario::ids::{Incarnation, Tick};
use scenario::mission::columns::ColumnValue;
use scenario::time::SimTime;

/// Returns the JSON Schema (draft 2020-12) of a [`Request`], with the schema of a [`Reply`] under its key `reply`.
#[must_use]
pub fn schema() -> serde_json::Value {
    let mut generator = SchemaSettings::draft2020_12().into_generator();
    let reply = generator.subschema_for::<Reply>();
    let mut schema = generator.into_root_schema_for::<Request>();
    schema.insert("reply".to_owned(), reply.to_value());
    let mut schema = schema.to_value();
    if let Some(Value::Array(faults)) = schema.pointer_mut("/$defs/Fault/oneOf") {
        for fault in &mut *faults {
            let name = fault["required"][0].as_str().unwrap_or_default();
            if let Some(kind) = Fault::kind_named(name) {
                fault["description"] = kind.spec.about.into();
            }
        }
        faults.push(json!({
            "description": "A fault that the mission defines.",
            "type": "object",
            "minProperties": 1,
            "maxProperties": 1,
            "propertyNames": { "not": { "enum": Fault::COMMON_NAMES } },
            "additionalProperties": {
                "type": "object",
                "additionalProperties": { "type": "number" },
            },
        }));
    }
    schema
}

/// A request to the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// A text that no other request of the run uses: 1 to 64 bytes without control characters. A repeated put is
    /// ignored.
    pub nonce: String,
    pub command: ControlCommand,
}

/// The commands that a request can contain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ControlCommand {
    /// A fault to arm.
    Fault(Order),
    /// The id of the fault to heal or disarm; `null` clears all faults.
    Clear(Option<String>),
    /// A query for the list of faults.
    List,
    /// A query for the state of the run.
    Status,
    /// A query for the setup and the log folder of the run.
    Describe,
    /// A command to the step clock. It changes no byte of the run.
    Clock(ClockCommand),
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ClockCommand {
    /// A pause before the next tick.
    Pause,
    /// The end of a pause.
    Resume,
    /// The number of ticks to run before the next pause.
    Step(u64),
    /// A multiple of real time, above 0; `null` runs as fast as possible.
    Speed(Option<f64>),
}

/// A reply from the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reply {
    /// The confirmation of an armed fault.
    Armed(Armed),
    /// The faults that were healed or disarmed.
    Cleared(Cleared),
    /// The run's faults, in the order in which they were armed.
    Faults(Vec<FaultStatus>),
    /// The state of the run.
    Status(Box<Status>),
    /// The setup and the log folder of the run.
    Description(Description),
    /// The state of the step clock after a command.
    Clock(ClockStatus),
    /// A refusal with the problem and its remedy. Nothing has changed.
    Refused(String),
}

/// An armed fault and its start.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Armed {
    /// The id that clears the fault.
    pub id: String,
    /// The tick at which the fault takes effect; `null` if it waits for an event.
    pub tick: Option<Tick>,
    /// The simulated time of that tick, ms.
    pub t_ms: Option<SimTime>,
}

/// The faults that a command cleared.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Cleared {
    pub ids: Vec<String>,
    /// The first tick without the faults.
    pub tick: Tick,
    pub t_ms: SimTime,
}

/// The present state of a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultStatus {
    pub id: String,
    /// The order that armed the fault.
    pub order: Order,
    pub phase: Phase,
    /// The simulated time at which the fault last took effect, ms.
    pub applied_ms: Option<SimTime>,
    /// The simulated time at which the fault last healed, ms.
    pub healed_ms: Option<SimTime>,
    /// The number of effects: messages, ticks with a false reading or an ignored command, and signals.
    pub hits: u64,
    /// The reason if the latest attempt failed; `null` after a success.
    #[serde(default)]
    pub failed: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// The fault waits for its trigger.
    Armed,
    /// The fault is in effect.
    InForce,
    /// The fault has ended or was disarmed.
    Over,
}

/// The state of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Status {
    pub run: String,
    /// The run folder, on the world's machine.
    pub folder: String,
    pub scenario: String,
    pub seed: u64,
    pub tick: Tick,
    pub t_ms: SimTime,
    pub clock: ClockStatus,
    /// The mission's progress: its columns of mission.csv.
    pub mission: Vec<ColumnValue>,
    /// The robots in the order of their ranks.
    pub robots: Vec<RobotStatus>,
    /// The faults that are armed or in effect.
    pub faults: Vec<FaultStatus>,
}

/// The properties of a run that do not change.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Description {
    pub run: String,
    /// The run folder, on the world's machine.
    pub folder: String,
    /// JSON text with `seed`, the resolved `scenario` and `alliance`, as in run.json but without the robots' own
    /// parameters.
    pub setup: String,
}

/// The state of the step clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockStatus {
    /// True if no further tick starts.
    pub paused: bool,
    /// The multiple of real time; `null` runs as fast as possible.
    pub speed: Option<f64>,
    /// The number of ticks left of a step command.
    pub steps_left: u64,
    /// The tick in progress, or the next one.
    pub tick: Tick,
    /// The missing robots or processes and a remedy, after an unpaused clock has stood still for some seconds.
    #[serde(default)]
    pub waits_for: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotStatus {
    pub robot: String,
    pub pid: Option<u32>,
    pub incarnation: Option<Incarnation>,
    pub state: AgentState,
    /// The coordinates of the center, m.
    pub x_m: f32,
    pub y_m: f32,
    /// The heading, rad counter-clockwise from the x axis.
    pub heading_rad: f32,
    /// True if the robot carries an item.
    pub carrying: bool,
    /// The task of the active behavior set.
    pub task: Option<String>,
    /// The robot's behavior sets, in the order of the catalog.
    pub sets: Vec<SetStatus>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AgentState {
    /// The robot is not in the mission.
    Absent,
    /// The robot has no agent.
    Dead,
    /// The agent has been invited or is about to join.
    Coming,
    /// The agent takes part in the mission.
    Present,
    /// The agent does not answer, or is stopped.
    Silent,
}

impl AgentState {
    /// Returns the name of the state as in JSON.
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

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SetStatus {
    pub behavior_set: String,
    pub motivation: f64,
    /// The state: hibernating, waiting or active.
    pub state: String,
}
