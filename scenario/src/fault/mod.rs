//! Faults, with the same vocabulary for the control topic, the scenario's timeline, the command line and the page.
//!
//! - `Fault`: a failure and its target. `Order`: a fault with its id, trigger and duration. `When`: an event as a
//!   trigger.
//! - [`RadioQuality`]: named sets of link faults. [`RandomFaults`]: random faults with mean times between failure and
//!   repair.
//!
//! Every form uses the same definition. In JSON and TOML a fault is a table with the fault's name as its only key:
//! `{"kill": "gold"}`, `fault.drop = { from = "green", to = "all", p = 0.3 }`. The text form matches the command line:
//! `drop --from green --to all --p 0.3`.

mod campaign;
mod check;
mod device;
mod form;
mod mission;
mod order;
mod radio;
#[cfg(test)]
mod tests;
mod text;
mod when;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Obstacle;
use crate::names::ALL;

pub use campaign::{FaultMix, RandomFaults};
pub use check::OrderError;
pub use device::Device;
pub use mission::{FaultArgument, FaultRange, FaultSpec, FaultValue, MissionFault};
pub use order::{Faults, Order};
pub use radio::{LinkQuality, RadioQuality};
pub use text::Role;
pub use when::{EventTrigger, TriggerEvent, WhenError};

/// A failure and its target. Robots are identified by name.
// `form` implements the serialization in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", remote = "Self")]
pub enum Fault {
    /// SIGKILL to the robot's process; healed by a restart in a new incarnation.
    Kill(String),
    /// SIGTERM to the robot's process, which ends by itself; healed by a restart in a new incarnation.
    Terminate(String),
    /// SIGSTOP to the robot's process; healed by SIGCONT.
    Pause(String),
    /// SIGCONT to the robot's process; ends a pause early.
    Continue(String),
    /// Start of the robot's process in a new incarnation. A running process is killed first.
    Restart(String),
    /// Arrival of a robot that the scenario marks as absent: its body appears at its start and its process starts.
    Add(String),
    /// Removal of a robot: its process is killed and its body disappears.
    Remove(String),

    /// Loss of messages on directed links.
    Drop(Loss),
    /// Delay of messages on directed links.
    Delay(Delay),
    /// Duplicate delivery of messages on directed links.
    Duplicate(LinkChance),
    /// Delivery of messages after the next one of their sender.
    Reorder(LinkChance),
    /// Retention of messages until the fault heals. Then all are delivered at once.
    Hold(LinkSelection),
    /// Isolation of groups of robots from each other. Robots in no group remain connected to all.
    Partition(Partition),
    /// Loss of all messages from this robot.
    Mute(String),
    /// Loss of all messages to this robot.
    Deaf(String),
    /// Loss of messages between robots whose centers are farther apart than this.
    Range(RangeFault),
    Radio(RadioQuality),

    /// Failure or false readings of a sensor.
    Sensor(SensorFault),
    /// Failure of a motor or the gripper.
    Actuator(ActuatorFault),
    /// Loss of power: the robot's body ignores all commands, and its energy reads 0.
    Power(String),
    /// A robot that continues to broadcast its activity but does not act.
    Babble(String),

    /// A rectangle on the floor: an obstacle, or a patch with a penetrability above 0.1. Healing removes it.
    Obstacle(Obstacle),
    /// Relocation of a robot's body.
    MoveRobot(MoveRobot),

    /// A fault that the mission defines.
    #[schemars(skip)]
    Mission(MissionFault),

    /// Decline of a skill that the robot's controller cannot detect directly.
    Skill(SkillFault),
}

/// An end of a link: a robot by its name, or `all`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "String", into = "String")]
#[schemars(with = "String")]
pub enum LinkEnd {
    /// Every robot of the team.
    #[default]
    All,
    /// The robot with this name.
    Robot(String),
}

impl LinkEnd {
    #[must_use]
    pub fn includes(&self, robot: &str) -> bool {
        match self {
            Self::All => true,
            Self::Robot(name) => name == robot,
        }
    }

    /// Returns `all` or the robot's name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => ALL,
            Self::Robot(name) => name,
        }
    }
}

impl From<String> for LinkEnd {
    fn from(name: String) -> Self {
        if name == ALL {
            Self::All
        } else {
            Self::Robot(name)
        }
    }
}

impl From<LinkEnd> for String {
    fn from(who: LinkEnd) -> Self {
        who.as_str().to_owned()
    }
}

/// Directed links from senders to receivers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LinkSelection {
    pub from: LinkEnd,
    pub to: LinkEnd,
}

/// Loss of messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Loss {
    #[serde(default)]
    pub from: LinkEnd,
    #[serde(default)]
    pub to: LinkEnd,
    /// The share of messages that get lost in the long run, 0 to 1.
    pub p: f64,
    /// The mean length of a burst in which every message is lost, s; 0 makes losses independent (Gilbert 1960).
    #[serde(default)]
    pub burst_s: f64,
}

/// Delay of messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Delay {
    #[serde(default)]
    pub from: LinkEnd,
    #[serde(default)]
    pub to: LinkEnd,
    /// The delay of every message, s.
    pub delay_s: f64,
    /// The maximum additional delay, uniformly distributed, s.
    #[serde(default)]
    pub jitter_s: f64,
}

/// A random effect on messages of directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkChance {
    #[serde(default)]
    pub from: LinkEnd,
    #[serde(default)]
    pub to: LinkEnd,
    /// The share of affected messages, 0 to 1.
    pub p: f64,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Partition {
    /// The groups of robots. A robot is in one group at most.
    pub groups: Vec<Vec<String>>,
    /// True if later groups still receive messages of earlier ones.
    #[serde(default)]
    pub one_way: bool,
}

/// A limit of the radio range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeFault {
    /// The maximum distance, center to center, m.
    pub range_m: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensorMode {
    /// No readings at all.
    Dead,
    /// Repetition of the last reading.
    Stuck,
    /// An independent, normally distributed error of every number.
    Noise(SensorError),
    /// The same error of every number.
    Bias(SensorError),
    /// No reading in this share of the steps, 0 to 1.
    Dropout(f64),
}

/// The size of an error: the standard deviation of noise, or the amount of a bias. Distances and both coordinates have
/// an error in meters, the heading in degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensorError {
    pub m: f32,
    /// The error of the heading, position sensor only, degrees.
    pub deg: f32,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorFault {
    pub robot: String,
    /// The name of the sensing device.
    pub device: Device,
    pub mode: SensorMode,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ActuatorMode {
    /// A dead drive: the robot neither turns nor moves.
    Dead,
    /// A speed and turn rate reduced to this share, 0 to 1.
    Slowed(f32),
    /// An additional turn rate while the robot is commanded to move or turn, degrees/s, positive counter-clockwise.
    TurnBias(f32),
    /// A dead motor of one wheel: the robot drives around that wheel.
    OneWheel(Side),
    /// A gripper that neither opens nor closes.
    Gripper,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The left side, seen along the robot's heading.
    Left,
    /// The right side, seen along the robot's heading.
    Right,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActuatorFault {
    pub robot: String,
    pub mode: ActuatorMode,
}

/// A decline of a robot's skill.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkillFault {
    pub robot: String,
    /// The mission's name of the skill.
    pub skill: String,
    /// The remaining share of the skill, 0 to 1.
    pub share: f64,
}

/// A new place for a robot's body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MoveRobot {
    pub robot: String,
    /// The x coordinate of the center, m.
    pub x_m: f32,
    /// The y coordinate of the center, m.
    pub y_m: f32,
    /// The new heading, degrees counter-clockwise from x; absent keeps the present one.
    #[serde(default)]
    pub heading_deg: Option<f32>,
}
