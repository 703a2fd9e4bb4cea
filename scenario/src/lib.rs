//! Scenario files: the inputs of a run, with every default.
//!
//! `alliance list scenarios reference` documents every key. Lengths are in metres, angles in degrees, times in seconds.
//! Rectangles have a lower left corner and a size.

mod agent_setup;
mod alliance;
mod allocators;
mod catalog;
mod changed_values;
mod check_setup;
mod error;
pub mod fault;
mod geometry;
pub mod ids;
pub mod limits;
mod load;
pub mod mission;
pub mod names;
mod obstacle;
mod parameters;
mod path;
mod profile;
mod properties;
mod radio;
mod reading;
mod resolve;
pub mod rng;
mod room;
mod roster;
mod setup;
mod slots;
mod statement;
mod team;
pub mod testkit;
pub mod time;
mod toml_file;
mod toml_value;
mod unread;
mod validate;
mod values;
mod vocabulary;
mod weights;

use glam::Vec2;
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
pub use error::{Problem, decode_text, listed, name_remedy, shortened};
pub use parameters::{ParameterDefault, ParameterRange, ParameterSpec};
pub use path::KeyPath;
pub use profile::{LearnedTimes, LearnedTimesByTask, Profile};
pub use properties::{ParameterFile, SkippedKey};
pub use radio::{Fading, Radio, Walls};
pub use resolve::Resolved;
pub use room::Room;
pub use roster::Roster;
pub use setup::{Setup, SetupFile};
pub use slots::fill_slots;
pub use toml_file::TomlFile;
pub use unread::UntypedTable;
pub use validate::{MAX_ROBOTS, MAX_TASKS};
pub use vocabulary::Vocabulary;
pub use weights::Weights;

/// A scenario file. It is read with a [`Vocabulary`] of missions and allocators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// Plain deserialization is not available, because it would omit the mission.
#[serde(default, deny_unknown_fields, remote = "Self")]
pub struct Scenario {
    /// The name, one word.
    pub name: String,
    /// The description for `alliance list scenarios`.
    pub description: String,
    /// The length of a step, ms of simulated time, 1 to 500.
    pub step_ms: u64,
    /// The simulated time after which the run ends incomplete, s.
    pub limit_s: f64,
    /// The order in which robots step and receive broadcasts; absent uses the order of the preset in `[alliance]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_order: Option<StepOrder>,
    /// The team's allocator; absent is [`Scenario::DEFAULT_ALLOCATOR`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allocator: Option<String>,
    /// The floor inside the border.
    pub room: Room,
    /// The body and drive of all robots. A robot may state its own speeds and turn rate.
    pub body: Body,
    /// The devices of robots that state none; see [`Robot::devices`].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub devices: Vec<String>,
    /// The skills of robots that state none; see [`Robot::skills`].
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub skills: BTreeMap<String, f64>,
    /// The sensor ranges of all robots.
    pub sensors: Sensors,
    /// The radio of all robots.
    #[serde(skip_serializing_if = "Radio::is_unlimited")]
    pub radio: Radio,
    /// The robots' batteries; absent disables the energy simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
    /// The mission: the section with its name.
    #[serde(flatten, skip_deserializing)]
    pub mission: MissionSection,
    /// The team, in rank order.
    pub robots: Vec<Robot>,
    /// Rectangles on the floor: obstacles, and patches that slow down or speed up robots.
    pub obstacles: Vec<Obstacle>,
    /// The scheduled and the random faults.
    #[serde(skip_serializing_if = "Faults::is_empty")]
    pub faults: Faults,
    /// The number of robots per task and its priority, by task name.
    pub tasks: BTreeMap<String, TaskSection>,
    /// The preset, switches and parameters of ALLIANCE.
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
        // The derived implementation.
        Self::serialize(self, serializer)
    }
}

impl Scenario {
    /// Returns the step order in force. ALLIANCE's switches may state it, too.
    #[must_use]
    pub fn step_order(&self) -> StepOrder {
        self.step_order
            .or(self.alliance.switches.step_order)
            .unwrap_or_else(|| self.alliance.preset.step_order())
    }

    /// Sets the step order and removes any other statement of it.
    pub fn set_step_order(&mut self, order: StepOrder) {
        self.step_order = Some(order);
        self.alliance.switches.step_order = None;
    }

    /// Gives all robots the same allocator.
    pub fn set_allocator(&mut self, name: &str) {
        self.allocator = Some(name.to_owned());
        for robot in &mut self.robots {
            robot.allocator = None;
        }
    }
}

impl Scenario {
    /// Returns the text of an equal scenario file. The function is not generic, so serde's code is compiled in this
    /// crate alone.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }

    /// Returns the mission's section in the mission's own type.
    ///
    /// # Panics
    /// Panics if the section has another type. Only the scenario's own mission may call this function.
    #[must_use]
    pub fn section<T: Any>(&self) -> &T {
        let section = self.mission.values();
        section.unwrap_or_else(|| panic!("{:?} has another type", self.mission.name()))
    }

    /// Returns the robot with this name. A problem is at the key of the name.
    pub fn find_robot(&self, key: impl Into<KeyPath>, name: &str) -> Result<&Robot, Problem> {
        let mut robots = self.robots.iter();
        robots.find(|robot| robot.name == name).ok_or_else(|| {
            let names = self.robots.iter().map(|robot| robot.name.as_str());
            let what = format!("the scenario has no robot '{name}'");
            Problem::at(key, what, name_remedy(name, names))
        })
    }

    /// Returns the body with the speeds and the turn rate that the robot states.
    #[inline]
    #[must_use]
    pub fn body_of(&self, robot: &Robot) -> Body {
        Body {
            speed_m_s: robot.speed_m_s.unwrap_or(self.body.speed_m_s),
            push_m_s: robot.push_m_s.unwrap_or(self.body.push_m_s),
            turn_deg_s: robot.turn_deg_s.unwrap_or(self.body.turn_deg_s),
            ..self.body
        }
    }

    /// Copies the team's devices and skills to the robots that state none.
    fn apply_team_defaults(&mut self) {
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

/// A robot's body and drive: a disc that turns on the spot and moves only forward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Body {
    /// The radius of the disc, m.
    pub radius_m: f32,
    /// The top speed on neutral ground, m/s.
    pub speed_m_s: f32,
    /// The top speed while pushing an object, m/s. The mission defines the objects that give way.
    pub push_m_s: f32,
    /// The top turn rate, degrees per second.
    pub turn_deg_s: f32,
    /// The reach of the gripper from the robot's edge, m. With a reach above the radius, teammates can take an item
    /// from under a stopped robot.
    pub reach_m: f32,
    /// The penetrability of robots to each other: 0 is solid, 1.0 is the thesis' behavior.
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

/// Sensor ranges, measured from the robot's edge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// The range of the front and side border sensors, m.
    pub border_range_m: f32,
    /// The range of the collision avoidance, m.
    pub avoidance_range_m: f32,
    /// The range at which robots detect items on the floor, m. Scenario files use the key `waste_range_m`.
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

/// A robot's battery and its consumption.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Energy {
    /// Charge at the start, J.
    pub capacity_j: f32,
    /// The constant consumption, W.
    pub idle_w: f32,
    /// The additional consumption at top speed, in proportion to the speed, W.
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

/// A robot with its equipment, tasks and start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// The robot's unique name.
    pub name: String,
    /// True if the robot has the side border sensor, which find-locations-methodical requires.
    #[serde(default)]
    pub side_sensor: bool,
    /// True if the robot joins the mission only with the fault `add`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub absent: bool,
    /// The start; absent uses a start of the mission, facing the left wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Start>,
    /// The names of the tasks that the robot has behavior sets for; empty means all. A file then omits the key.
    #[serde(
        default,
        deserialize_with = "tasks",
        skip_serializing_if = "Vec::is_empty"
    )]
    pub tasks: Vec<String>,
    /// The top speed on neutral ground, m/s; absent uses that of `[body]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f32>,
    /// The top speed while pushing, m/s; absent uses that of `[body]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub push_m_s: Option<f32>,
    /// The top turn rate, degrees per second; absent uses that of `[body]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_deg_s: Option<f32>,
    /// The devices besides those of all robots. Absent uses the team's, which the [setup](Setup) of a run states here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub devices: Option<Vec<String>>,
    /// The levels of the mission's skills by name. The robot cannot do what is not named. Absent uses the team's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skills: Option<BTreeMap<String, f64>>,
    /// The largest load that the robot carries, in the unit of the mission's demands; absent carries any load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capacity: Option<f64>,
    /// The robot's own allocator; absent uses the team's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allocator: Option<String>,
    /// The name of the robot's external controller, which decides instead of the allocator. The command for it comes
    /// from the user who starts the run. A scenario contains no commands, so that a downloaded scenario cannot run
    /// programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controller: Option<String>,
}

impl Robot {
    /// The device that `side_sensor = true` stands for.
    pub const SIDE_BORDER: &str = "side-border";

    /// Returns true if the robot has a device that not all robots have.
    #[must_use]
    pub fn has_device(&self, device: &str) -> bool {
        let by_flag = self.side_sensor && device == Self::SIDE_BORDER;
        by_flag || self.devices.iter().flatten().any(|name| name == device)
    }

    /// Returns the level of a skill, 0 or more; `None` if the robot states no skills.
    #[must_use]
    pub fn skill(&self, name: &str) -> Option<f64> {
        let skills = self.skills.as_ref()?;
        Some(skills.get(name).copied().unwrap_or(0.0))
    }

    /// Returns the skill level for a behavior, 0 or more. It is 1 if the behavior needs no skill or the robot states no
    /// skills.
    #[must_use]
    pub fn skill_at(&self, behavior: &BehaviorSpec) -> f64 {
        let skill = behavior.skill.as_deref().and_then(|name| self.skill(name));
        skill.unwrap_or(1.0)
    }
}

/// The pose in which a robot starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// The x coordinate of the center, m.
    pub x_m: f32,
    /// The y coordinate of the center, m.
    pub y_m: f32,
    /// Heading, degrees counter-clockwise from x; 180 faces the left wall.
    #[serde(default = "facing_left")]
    pub heading_deg: f32,
}

impl Start {
    /// Returns the place of the center, m.
    #[must_use]
    pub fn position(&self) -> Vec2 {
        Vec2::new(self.x_m, self.y_m)
    }
}

fn facing_left() -> f32 {
    180.0
}

/// The properties of a task besides its behavior sets (thesis §3.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TaskSection {
    /// The number of robots that may execute the task at once; 1 is exclusive. Absent uses the mission's number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_robots: Option<u32>,
    /// The priority. Of two sets at the threshold in the same step, the one with the higher priority activates.
    pub priority: i32,
}

/// Rejects an empty list, because a missing key means all tasks.
fn tasks<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    let tasks = Vec::deserialize(from)?;
    if tasks.is_empty() {
        return Err(D::Error::custom(
            "an empty list means no task, and a missing key means all tasks",
        ));
    }
    Ok(tasks)
}
