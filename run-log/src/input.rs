//! Inputs: external events that changed a run. The scenario, the seed and the inputs together determine the run.

use std::collections::BTreeMap;

use proto::process::ProcessAction;
use proto::readings::Proximity;
use scenario::fault::Order;
use scenario::ids::{Incarnation, Tick};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// A line of inputs.jsonl.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputLine {
    /// The tick that the input affected.
    pub tick: Tick,
    pub input: Input,
}

/// An external event, with robots by name. `moment` is the order index within the tick; `None` means the start of the
/// tick, and for [`Self::Gone`] the collection of reports. `scripted` inputs were caused by a fault: a replay
/// reproduces them without the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Input {
    /// A new agent of the robot takes part from this tick on.
    Join {
        robot: String,
        incarnation: Incarnation,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// The robot's agent has ended. The world detected it while it collected the reports of this tick.
    Gone {
        robot: String,
        /// The incarnation that ended. 0 means that the process ended or was stopped before the robot joined.
        incarnation: Incarnation,
        /// The last tick in which a report of the incarnation counted.
        last_counted: Option<Tick>,
        /// `true` if the manifests of the team listed the broadcasts of that tick.
        listed: bool,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// The agent did not answer in this tick, so the barrier no longer waits for it.
    StallBegin {
        robot: String,
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// The agent sent a report again and takes part from this tick on.
    StallEnd {
        robot: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// A listed broadcast did not arrive, without a fault that dropped it.
    Lost {
        receiver: String,
        sender: String,
        sent_tick: Tick,
        /// The index among the sender's broadcasts of that tick.
        index: u16,
    },
    /// An operator ordered a fault, which is armed from the start of this tick on.
    Order {
        order: Order,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
    },
    /// An operator cleared faults before this tick.
    Clear {
        ids: Vec<String>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
    },
    /// A fault requested a process action that failed.
    Failed {
        robot: String,
        act: ProcessAction,
        /// The number of earlier process actions in this tick.
        #[serde(default)]
        number: Option<u32>,
        /// The cause, as written to the log.
        #[serde(default)]
        reason: String,
    },
    /// The run left the course of the run that it repeated, at the start of this tick.
    Branch(Branch),
    /// The pose of a body that moves in another world, set before the sensing of this tick.
    Body(BodyInput),
}

/// The latest known pose of an external body, in the frame of the room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyInput {
    pub robot: String,
    pub x_m: f32,
    pub y_m: f32,
    pub heading_rad: f32,
    /// The time of the pose by the clock of the other world, ns.
    pub stamp_ns: i64,
    /// `true` if no pose has arrived since the previous tick: this is the pose of that tick.
    #[serde(default, skip_serializing_if = "is_false")]
    pub late: bool,
    /// The beams of collision avoidance that the other world measured. `None`: this world senses the scenario's room.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<ScanInput>,
}

/// The latest known scan of an external body, as the reading of collision avoidance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScanInput {
    /// The time of the scan by the clock of the other world, ns.
    pub stamp_ns: i64,
    /// `true` if no scan has arrived since the previous tick.
    #[serde(default, skip_serializing_if = "is_false")]
    pub late: bool,
    pub beams: Proximity,
}

/// The changes of a branch. They take effect before anything else of their tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Branch {
    /// The faults that replace those that have not begun; `None` keeps those.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faults: Option<Vec<Order>>,
    /// The new parameters of the allocator, by the keys of [`scenario::Setup::with_parameters`]. All are finite, because
    /// JSON has no other numbers.
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        deserialize_with = "finite"
    )]
    pub parameters: BTreeMap<String, f64>,
}

fn finite<'de, D: Deserializer<'de>>(values: D) -> Result<BTreeMap<String, f64>, D::Error> {
    let values = BTreeMap::<String, f64>::deserialize(values)?;
    match values.values().all(|value| value.is_finite()) {
        true => Ok(values),
        false => Err(D::Error::custom("a parameter is not finite")),
    }
}

impl Branch {
    /// Returns whether the branch changes nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.faults.is_none() && self.parameters.is_empty()
    }
}

impl Input {
    /// Returns whether a replay reproduces the input by itself.
    #[must_use]
    pub fn is_scripted(&self) -> bool {
        match self {
            Self::Join { scripted, .. }
            | Self::Gone { scripted, .. }
            | Self::StallBegin { scripted, .. }
            | Self::StallEnd { scripted, .. } => *scripted,
            Self::Lost { .. }
            | Self::Order { .. }
            | Self::Clear { .. }
            | Self::Failed { .. }
            | Self::Branch(_)
            | Self::Body(_) => false,
        }
    }

    #[must_use]
    pub fn is_command(&self) -> bool {
        matches!(self, Self::Order { .. } | Self::Clear { .. })
    }

    /// Returns the order index within the tick, if the order matters.
    #[must_use]
    pub fn moment(&self) -> Option<u32> {
        match self {
            Self::Join { moment, .. }
            | Self::Gone { moment, .. }
            | Self::StallEnd { moment, .. }
            | Self::Order { moment, .. }
            | Self::Clear { moment, .. } => *moment,
            Self::StallBegin { .. }
            | Self::Lost { .. }
            | Self::Failed { .. }
            | Self::Branch(_)
            | Self::Body(_) => None,
        }
    }

    /// Returns the affected robot, if there is one.
    #[must_use]
    pub fn robot(&self) -> Option<&str> {
        match self {
            Self::Join { robot, .. }
            | Self::Gone { robot, .. }
            | Self::StallBegin { robot, .. }
            | Self::StallEnd { robot, .. }
            | Self::Failed { robot, .. } => Some(robot),
            Self::Lost { receiver, .. } => Some(receiver),
            Self::Body(body) => Some(&body.robot),
            Self::Order { .. } | Self::Clear { .. } | Self::Branch(_) => None,
        }
    }
}

fn is_false(value: &bool) -> bool {
    !value
}
