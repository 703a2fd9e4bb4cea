//! Scenario files: what a run is made of, with every default (DESIGN §7).
//!
//! `alliance scenarios reference` documents every key. Lengths in metres, angles in degrees (files are for people),
//! times in seconds, rectangles by their lower left corner and size.

mod alliance;
mod allocators;
mod briefing;
mod catalog;
mod document;
mod error;
mod geometry;
mod in_force;
pub mod limits;
mod load;
mod parameters;
mod path;
mod profile;
mod properties;
mod reading;
mod resolve;
mod roster;
mod setup;
mod statement;
mod toml_value;
mod unread;
mod validate;
mod values;
mod vocabulary;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::any::Any;
use std::collections::BTreeMap;

use crate::fault::Faults;
use crate::mission::section::MissionSection;

pub use crate::obstacle::Obstacle;
pub use alliance::{
    Alliance, AllianceSection, BehaviorParams, BehaviorSection, HistoryOrigin, Preset, RobotParams,
    RobotSection, StepOrder, SwitchSection, Switches,
};
pub use allocators::{AllocatorSpec, Allocators};
pub use catalog::{BehaviorSpec, Catalog, TaskSpec};
pub use error::{Problem, ScenarioError, instead, text_of};
pub use load::TomlFile;
pub use parameters::{ParameterDefault, ParameterRange, ParameterSpec};
pub use path::{Path, Step};
pub use profile::{KnownTimes, Profile, RobotTimes};
pub use properties::{ParameterFile, SkippedKey};
pub use resolve::Resolved;
pub use roster::Roster;
pub use setup::{Setup, SetupFile};
pub use unread::Unread;
pub use validate::MAX_ROBOTS;
pub use vocabulary::Vocabulary;

/// A scenario file. It is read with a [`Vocabulary`]: whoever reads it says which missions there are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// By itself it cannot be read: that would leave its mission out.
#[serde(default, deny_unknown_fields, remote = "Self")]
pub struct Scenario {
    /// Name, one word.
    pub name: String,
    /// What it shows, for `alliance scenarios`.
    pub description: String,
    /// Length of a step, ms of simulated time, 1 to 500.
    pub step_ms: u64,
    /// Simulated time after which the run ends incomplete, s.
    pub limit_s: f64,
    /// When robots step and hear each other; absent: as the preset of `[alliance]` has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_order: Option<StepOrder>,
    /// What decides which behavior set of a robot is active; absent: [`Scenario::DEFAULT_ALLOCATOR`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allocator: Option<String>,
    /// The border.
    pub room: Room,
    /// Body and drive; robots may have speeds and a turn rate of their own.
    pub body: Body,
    /// Devices of the robots that state none of their own; see [`Robot::devices`].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub devices: Vec<String>,
    /// Skills of the robots that state none of their own; see [`Robot::skills`].
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub skills: BTreeMap<String, f64>,
    /// Ranges of the sensors.
    pub sensors: Sensors,
    /// The robots' radio.
    #[serde(skip_serializing_if = "Radio::is_unlimited")]
    pub radio: Radio,
    /// Energy aspect of the robots; absent: not simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
    /// The mission: the section of its name.
    #[serde(flatten, skip_deserializing)]
    pub mission: MissionSection,
    /// The team, in rank order.
    pub robots: Vec<Robot>,
    /// Rectangles on the floor: obstacles, and patches that slow down or speed up.
    pub obstacles: Vec<Obstacle>,
    /// What goes wrong, and when.
    #[serde(skip_serializing_if = "Faults::is_empty")]
    pub faults: Faults,
    /// How many robots may work on a task, and its priority; by task name.
    pub tasks: BTreeMap<String, TaskSection>,
    /// ALLIANCE: preset, switches, parameters.
    pub alliance: AllianceSection,
    /// Parameters of the other allocators.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub allocators: Allocators,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            name: String::new(),
            description: String::new(),
            step_ms: 50,
            limit_s: 3600.0,
            step_order: None,
            allocator: None,
            room: Room::default(),
            body: Body::default(),
            devices: Vec::new(),
            skills: BTreeMap::new(),
            sensors: Sensors::default(),
            radio: Radio::default(),
            energy: None,
            mission: MissionSection::default(),
            robots: Vec::new(),
            obstacles: Vec::new(),
            faults: Faults::default(),
            tasks: BTreeMap::new(),
            alliance: AllianceSection::default(),
            allocators: Allocators::new(),
        }
    }
}

impl Serialize for Scenario {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // The derived one.
        Self::serialize(self, serializer)
    }
}

impl Scenario {
    /// The step order in force. It may stand among ALLIANCE's switches too, where it used to be.
    #[must_use]
    pub fn step_order(&self) -> StepOrder {
        self.step_order
            .or(self.alliance.switches.step_order)
            .unwrap_or_else(|| self.alliance.preset.step_order())
    }

    /// States the step order, in the place of whatever states it so far.
    pub fn set_step_order(&mut self, order: StepOrder) {
        self.step_order = Some(order);
        self.alliance.switches.step_order = None;
    }
}

impl Scenario {
    /// The text of a scenario file that says the same. Not generic, so that serde's code for it is compiled in this crate alone.
    ///
    /// # Errors
    /// When a section of a mission cannot be written.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }

    /// What it says of its mission, in the mission's own type.
    ///
    /// # Panics
    /// If that is another type: nobody but its mission asks.
    #[must_use]
    pub fn section<T: Any>(&self) -> &T {
        let section = self.mission.values();
        section.unwrap_or_else(|| panic!("{:?} has another type", self.mission.name()))
    }

    /// Body and drive of one robot of the team.
    #[must_use]
    pub fn body_of(&self, robot: &Robot) -> Body {
        Body {
            speed_m_s: robot.speed_m_s.unwrap_or(self.body.speed_m_s),
            push_m_s: robot.push_m_s.unwrap_or(self.body.push_m_s),
            turn_deg_s: robot.turn_deg_s.unwrap_or(self.body.turn_deg_s),
            ..self.body
        }
    }

    /// Gives the team's devices and skills to the robots that state none of their own.
    fn hand_down(&mut self) {
        for robot in &mut self.robots {
            if robot.devices.is_none() && !self.devices.is_empty() {
                robot.devices = Some(self.devices.clone());
            }
            if robot.skills.is_none() && !self.skills.is_empty() {
                robot.skills = Some(self.skills.clone());
            }
        }
    }
}

/// The border: a rectangle from (0, 0) to (width, height).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Room {
    /// Extent in x, m.
    pub width_m: f32,
    /// Extent in y, m.
    pub height_m: f32,
}

impl Default for Room {
    fn default() -> Self {
        Self {
            width_m: 12.0,
            height_m: 9.0,
        }
    }
}

/// A robot's body and drive: a disc that turns on the spot and moves only forward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Body {
    /// Radius of the disc, m.
    pub radius_m: f32,
    /// Top speed on neutral ground, m/s.
    pub speed_m_s: f32,
    /// Top speed at which it pushes what gives way to it, m/s. What does is the mission's.
    pub push_m_s: f32,
    /// Top turn rate, degrees per second.
    pub turn_deg_s: f32,
    /// How far from the robot's edge the gripper reaches, m. With more than the radius, a body that no longer moves keeps no
    /// item below it from its teammates.
    pub reach_m: f32,
    /// Penetrability of robots to each other: 0 solid, 1.0 the thesis' behaviour.
    pub robot_penetrability: f32,
}

impl Default for Body {
    fn default() -> Self {
        Self {
            radius_m: 0.20,
            speed_m_s: 0.5,
            push_m_s: 0.2,
            turn_deg_s: 90.0,
            reach_m: 0.25,
            robot_penetrability: 0.0,
        }
    }
}

/// Sensor ranges, counted from the robot's edge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// Front and side border sensors, m.
    pub border_range_m: f32,
    /// Collision avoidance, m.
    pub avoidance_range_m: f32,
    /// What a mission's robots see of the items that lie about, m. Files of before missions were many call it so.
    #[serde(rename = "waste_range_m")]
    pub item_range_m: f32,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            border_range_m: 0.5,
            avoidance_range_m: 0.4,
            item_range_m: 1.0,
        }
    }
}

/// The robots' radio.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Radio {
    /// Robots whose centers are farther apart than this never hear each other, m; absent: all hear all.
    pub range_m: Option<f32>,
}

impl Radio {
    /// Whether all hear all.
    #[must_use]
    pub fn is_unlimited(&self) -> bool {
        self.range_m.is_none()
    }
}

/// A battery.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Energy {
    /// Charge at the start, J.
    pub capacity_j: f32,
    /// Drawn always, W.
    pub idle_w: f32,
    /// Drawn on top of it at top speed, in proportion to the speed, W.
    pub drive_w: f32,
}

impl Default for Energy {
    fn default() -> Self {
        Self {
            capacity_j: 50_000.0,
            idle_w: 5.0,
            drive_w: 20.0,
        }
    }
}

/// One robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Whether it has the side border sensor, and with it find-locations-methodical.
    #[serde(default)]
    pub side_sensor: bool,
    /// Not in the mission until the fault `add` brings it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub absent: bool,
    /// Where it starts; absent: where robots of its mission begin, facing the left wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Start>,
    /// The tasks that it has behavior sets for, by name; empty: all. In a file the key is left out then.
    #[serde(
        default,
        deserialize_with = "tasks",
        skip_serializing_if = "Vec::is_empty"
    )]
    pub tasks: Vec<String>,
    /// Top speed on neutral ground, m/s; absent: that of `[body]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f32>,
    /// Top speed at which it pushes, m/s; absent: that of `[body]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub push_m_s: Option<f32>,
    /// Top turn rate, degrees per second; absent: that of `[body]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_deg_s: Option<f32>,
    /// Devices that it has beside those that all robots have; absent: the team's, which the [setup](Setup) of a run states here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub devices: Option<Vec<String>>,
    /// How good it is at what a mission calls skills, by their names; what is not named it cannot do. Absent: as with devices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skills: Option<BTreeMap<String, f64>>,
    /// Its own allocator; absent: the team's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allocator: Option<String>,
    /// Its mind, if that is a program of its own: a name, for which whoever starts the run has a command. It decides all, and the
    /// allocator nothing. A scenario has no commands, for one from elsewhere must not run programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mind: Option<String>,
}

impl Robot {
    /// The device that `side_sensor = true` stands for.
    pub const SIDE_BORDER: &str = "side-border";

    /// Whether it has a device that not all robots have.
    #[must_use]
    pub fn has_device(&self, device: &str) -> bool {
        let by_flag = self.side_sensor && device == Self::SIDE_BORDER;
        by_flag || self.devices.iter().flatten().any(|own| own == device)
    }

    /// How good it is at something, 0 and more; `None` if no skills of it are stated at all.
    #[must_use]
    pub fn skill(&self, name: &str) -> Option<f64> {
        let skills = self.skills.as_ref()?;
        Some(skills.get(name).copied().unwrap_or(0.0))
    }

    /// How good it is at a behavior, 0 and more: 1 where that takes no skill, or no skills of it are stated at all.
    #[must_use]
    pub fn skill_at(&self, behavior: &BehaviorSpec) -> f64 {
        let skill = behavior.skill.as_deref().and_then(|name| self.skill(name));
        skill.unwrap_or(1.0)
    }
}

/// Where a robot starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Center, m.
    pub x_m: f32,
    /// Center, m.
    pub y_m: f32,
    /// Heading, degrees counter-clockwise from x; 180 faces the left wall.
    #[serde(default = "facing_left")]
    pub heading_deg: f32,
}

fn facing_left() -> f32 {
    180.0
}

/// What a task's definition says beside its behavior sets (thesis §3.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TaskSection {
    /// How many robots may execute it at once; 1 is exclusive. Absent: as the mission has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_robots: Option<u32>,
    /// Of two sets at the threshold in the same step, the one with the higher priority activates.
    pub priority: i32,
}

/// Who writes an empty list means none.
fn tasks<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    let tasks = Vec::deserialize(from)?;
    if tasks.is_empty() {
        return Err(D::Error::custom(
            "without tasks a robot does nothing, and without the key it does all",
        ));
    }
    Ok(tasks)
}
