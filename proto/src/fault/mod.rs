//! What can go wrong, in one vocabulary for the control topic, the scenario's timeline, the command line and the page
//! (DESIGN §6).
//!
//! - [`Fault`]: what happens, to whom. [`Order`]: a fault with its id, its trigger and its duration; [`When`]: an event as a
//!   trigger.
//! - [`RadioQuality`]: named bundles of link faults. [`Campaign`]: random faults by mean times between failure and repair.
//!
//! One definition serves every form. In JSON and TOML a fault is a table with the fault's name as its only key:
//! `{"kill": "gold"}`, `fault.drop = { from = "green", to = "all", p = 0.3 }`. As text it reads like the command line:
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

use crate::obstacle::Obstacle;

pub use campaign::{Campaign, Mix};
pub use check::OrderError;
pub use device::Device;
pub use mission::{FaultArgument, FaultRange, FaultSpec, MissionFault};
pub use order::{Faults, Order};
pub use radio::{LinkTerms, RadioQuality};
pub use text::Role;
pub use when::{Happening, When, WhenError};

/// What goes wrong. Robots go by their names.
// `form` reads and writes it in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", remote = "Self")]
pub enum Fault {
    /// SIGKILL to the robot's process; healed by a restart in a new incarnation.
    Kill(String),
    /// SIGTERM to the robot's process, which ends by itself; healed by a restart in a new incarnation.
    Terminate(String),
    /// SIGSTOP to the robot's process; healed by SIGCONT.
    Pause(String),
    /// SIGCONT to the robot's process; ends a pause before its time.
    Continue(String),
    /// Starts the robot's process in a new incarnation; one that still lives is killed first.
    Restart(String),
    /// Brings a robot that the scenario calls absent into the mission: its body appears at its start, its process starts.
    Add(String),
    /// Takes a robot out of the mission: its process is killed, its body disappears.
    Remove(String),

    /// Messages get lost.
    Drop(Loss),
    /// Messages come late.
    Delay(Delay),
    /// Messages come twice.
    Duplicate(Chance),
    /// Messages are overtaken by the next one of their sender.
    Reorder(Chance),
    /// Messages are held back until the fault heals, and then come all at once.
    Hold(Link),
    /// Groups of robots do not hear each other; robots in no group hear everybody.
    Partition(Partition),
    /// Nobody hears this robot.
    Mute(String),
    /// This robot hears nobody.
    Deaf(String),
    /// Robots further apart than this, center to center, do not hear each other.
    Range(RangeFault),
    /// The radio of all links is of this quality.
    Radio(RadioQuality),

    /// A sensor fails or lies.
    Sensor(SensorFault),
    /// A motor or the gripper fails.
    Actuator(ActuatorFault),
    /// The robot has no power: its body obeys nothing, its energy reads 0.
    Power(String),
    /// The robot goes on telling its team what it does, and does none of it.
    Babble(String),

    /// A rectangle on the floor: an obstacle, or with a penetrability above 0.1 a patch; healed by taking it away.
    Obstacle(Obstacle),
    /// A robot's body is put elsewhere.
    MoveRobot(MoveRobot),

    /// What only the mission knows.
    #[schemars(skip)]
    Mission(MissionFault),

    /// A robot gets worse at something, and does not know.
    Skill(SkillFault),
}

/// One end of a link: a robot by its name, or `all`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "String", into = "String")]
#[schemars(with = "String")]
pub enum Who {
    /// Every robot.
    #[default]
    All,
    /// This one.
    Robot(String),
}

impl Who {
    /// Whether that robot is meant.
    #[must_use]
    pub fn includes(&self, robot: &str) -> bool {
        match self {
            Self::All => true,
            Self::Robot(name) => name == robot,
        }
    }

    /// `all` or the robot's name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => "all",
            Self::Robot(name) => name,
        }
    }
}

impl From<String> for Who {
    fn from(name: String) -> Self {
        if name == "all" {
            Self::All
        } else {
            Self::Robot(name)
        }
    }
}

impl From<Who> for String {
    fn from(who: Who) -> Self {
        who.as_str().to_owned()
    }
}

/// Directed links: what `to` hears of `from`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Link {
    /// Who speaks.
    pub from: Who,
    /// Who hears it.
    pub to: Who,
}

/// Loss of messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Loss {
    /// Who speaks.
    #[serde(default)]
    pub from: Who,
    /// Who hears it.
    #[serde(default)]
    pub to: Who,
    /// Share of messages that get lost in the long run, 0 to 1.
    pub p: f64,
    /// Mean length of a burst in which every message is lost, s; 0: each message has its own draws (Gilbert 1960).
    #[serde(default)]
    pub burst_s: f64,
}

/// Delay of messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Delay {
    /// Who speaks.
    #[serde(default)]
    pub from: Who,
    /// Who hears it.
    #[serde(default)]
    pub to: Who,
    /// Delay of every message, s.
    pub delay_s: f64,
    /// Up to this much more, evenly distributed, s.
    #[serde(default)]
    pub jitter_s: f64,
}

/// Something that befalls some messages on directed links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Chance {
    /// Who speaks.
    #[serde(default)]
    pub from: Who,
    /// Who hears it.
    #[serde(default)]
    pub to: Who,
    /// Share of messages that it befalls, 0 to 1.
    pub p: f64,
}

/// A partition of the team.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Partition {
    /// Groups of robots, each robot in one at most.
    pub groups: Vec<Vec<String>>,
    /// Later groups still hear earlier ones.
    #[serde(default)]
    pub one_way: bool,
}

/// Radio range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeFault {
    /// Greatest distance, center to center, m.
    pub range_m: f32,
}

/// How a sensor fails.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensorMode {
    /// Tells nothing.
    Dead,
    /// Goes on telling what it told last.
    Stuck,
    /// Every number it tells has a normally distributed error of its own.
    Noise(SensorError),
    /// Every number it tells is off by the same.
    Bias(SensorError),
    /// Tells nothing in this share of the steps, 0 to 1.
    Dropout(f64),
}

/// Size of an error: the standard deviation of noise, or the amount of a bias. Distances and coordinates, in x and y alike,
/// are off by meters, the heading by degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensorError {
    /// Of lengths, m.
    pub m: f32,
    /// Of the heading; position sensor only, degrees.
    pub deg: f32,
}

/// A broken sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorFault {
    /// Whose.
    pub robot: String,
    /// Which one.
    pub device: Device,
    /// How.
    pub mode: SensorMode,
}

/// How an actuator fails.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ActuatorMode {
    /// The drive is dead: the robot neither turns nor moves.
    Dead,
    /// Speed and turn rate are this share of what they should be, 0 to 1.
    Slowed(f32),
    /// While it is told to move or turn, it turns by this much more, degrees/s, positive counter-clockwise.
    TurnBias(f32),
    /// The motor of one wheel is dead: it drives round that wheel.
    OneWheel(Side),
    /// The gripper neither opens nor closes.
    Gripper,
}

/// A side of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Left, seen along its heading.
    Left,
    /// Right.
    Right,
}

/// A broken actuator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActuatorFault {
    /// Whose.
    pub robot: String,
    /// How.
    pub mode: ActuatorMode,
}

/// A skill that has got worse.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkillFault {
    /// Whose.
    pub robot: String,
    /// Which one, by the name that the mission gives it.
    pub skill: String,
    /// Share that is left of it, 0 to 1.
    pub share: f64,
}

/// A robot elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MoveRobot {
    /// Which one.
    pub robot: String,
    /// Center, m.
    pub x_m: f32,
    /// Center, m.
    pub y_m: f32,
    /// New heading, degrees counter-clockwise from x; absent: as it is.
    #[serde(default)]
    pub heading_deg: Option<f32>,
}
