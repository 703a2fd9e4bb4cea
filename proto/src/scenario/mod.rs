//! Scenario files: what a run is made of, with every default (DESIGN §7).
//!
//! `launch/scenarios/reference.toml` documents every key. Lengths in metres, angles in degrees (files are for people),
//! times in seconds, rectangles by their lower left corner and size.

mod alliance;
mod catalog;
mod document;
mod error;
mod family;
mod geometry;
mod in_force;
mod load;
mod path;
mod properties;
mod resolve;
mod statement;
#[cfg(test)]
mod tests;
mod toml_value;
mod validate;
mod values;

use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::fault::Faults;

pub use alliance::{
    Alliance, AllianceSection, BehaviorParams, BehaviorSection, HistoryOrigin, Preset, RobotParams,
    RobotSection, StepOrder, SwitchSection, Switches,
};
pub use catalog::{BehaviorKind, BehaviorSpec, Catalog, TaskSpec};
pub(crate) use error::instead;
pub use error::{ScenarioError, text_of};
pub use load::TomlFile;
pub use path::Step;
pub use properties::{ParameterFile, SkippedKey};
pub use resolve::Resolved;
pub(crate) use validate::MAX_ITEMS_IN_ALL;
pub use validate::{MAX_ROBOTS, MAX_SPILLS};

/// A run, complete: what the world sends to every agent and writes to run.json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Seed of all random streams.
    pub seed: u64,
    /// Scenario with all defaults filled in.
    pub scenario: Scenario,
    /// Every ALLIANCE value in force.
    pub alliance: Alliance,
}

/// A scenario file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Name, one word.
    pub name: String,
    /// What it shows, for `alliance scenarios`.
    pub description: String,
    /// Length of a step, ms of simulated time, 1 to 500.
    pub step_ms: u64,
    /// Simulated time after which the run ends incomplete, s.
    pub limit_s: f64,
    /// The border.
    pub room: Room,
    /// Body and drive, the same for all robots.
    pub body: Body,
    /// Ranges of the sensors.
    pub sensors: Sensors,
    /// The robots' radio.
    #[serde(skip_serializing_if = "Radio::is_unlimited")]
    pub radio: Radio,
    /// Energy aspect of the robots; absent: not simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
    /// The waste clean-up.
    pub waste: WasteSection,
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
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            name: "waste-cleanup".to_owned(),
            description: String::new(),
            step_ms: 50,
            limit_s: 3600.0,
            room: Room::default(),
            body: Body::default(),
            sensors: Sensors::default(),
            radio: Radio::default(),
            energy: None,
            waste: WasteSection::default(),
            robots: [("blue", true), ("gold", false), ("green", false)]
                .map(|(name, side_sensor)| Robot {
                    name: name.to_owned(),
                    side_sensor,
                    ..Robot::default()
                })
                .to_vec(),
            obstacles: Vec::new(),
            faults: Faults::default(),
            tasks: BTreeMap::new(),
            alliance: AllianceSection::default(),
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
    /// Waste sensor, m.
    pub waste_range_m: f32,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            border_range_m: 0.5,
            avoidance_range_m: 0.4,
            waste_range_m: 1.0,
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

/// The hazardous waste clean-up (thesis §4.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WasteSection {
    /// The initial spill locations.
    pub spills: Vec<Spill>,
    /// Radius of each spill, m.
    pub spill_radius_m: f32,
    /// Radius of an item, m.
    pub item_radius_m: f32,
    /// The desired final spill location.
    pub deposit: Deposit,
    /// More deposits of the same radius, for large rooms: waste goes to the one nearest to its spill.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further_deposits: Vec<Spot>,
    /// The report progress site.
    pub report_site: ReportSite,
    /// Wanted time between two progress reports, s.
    pub report_period_s: f64,
    /// Whether the robots know the border beforehand, and with it where everything is.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub border_known: bool,
}

impl WasteSection {
    /// Centers of all deposits.
    pub fn deposits(&self) -> impl Iterator<Item = Spot> + '_ {
        let first = Spot {
            x_fraction: self.deposit.x_fraction,
            y_fraction: self.deposit.y_fraction,
        };
        std::iter::once(first).chain(self.further_deposits.iter().copied())
    }
}

/// A place in the room.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spot {
    /// As a fraction of the room's width.
    pub x_fraction: f32,
    /// As a fraction of the room's height.
    pub y_fraction: f32,
}

impl Spot {
    /// Where that is, m.
    #[must_use]
    pub fn in_room(self, room: &Room) -> Vec2 {
        Vec2::new(room.width_m, room.height_m) * Vec2::new(self.x_fraction, self.y_fraction)
    }
}

impl Spill {
    /// Its center.
    #[must_use]
    pub fn spot(&self) -> Spot {
        Spot {
            x_fraction: self.x_fraction,
            y_fraction: self.y_fraction,
        }
    }
}

impl Default for WasteSection {
    fn default() -> Self {
        let spill = |name: &str, y_fraction| Spill {
            name: name.to_owned(),
            items: 12,
            x_fraction: 1.0 / 3.0,
            y_fraction,
        };
        Self {
            spills: vec![spill("top", 2.0 / 3.0), spill("bottom", 1.0 / 3.0)],
            spill_radius_m: 0.8,
            item_radius_m: 0.05,
            deposit: Deposit::default(),
            further_deposits: Vec::new(),
            report_site: ReportSite::default(),
            report_period_s: 120.0,
            border_known: false,
        }
    }
}

/// An initial spill location. Robots know the fractions, not the place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spill {
    /// Name of the spill; its task is `move-spill(NAME)`.
    pub name: String,
    /// Number of items at the start.
    pub items: u32,
    /// Centre, as a fraction of the room's width.
    pub x_fraction: f32,
    /// Centre, as a fraction of the room's height.
    pub y_fraction: f32,
}

impl Default for Spill {
    fn default() -> Self {
        Self {
            name: String::new(),
            items: 12,
            x_fraction: 1.0 / 3.0,
            y_fraction: 0.5,
        }
    }
}

/// The deposit: a disc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Deposit {
    /// Radius, m.
    pub radius_m: f32,
    /// Centre, as a fraction of the room's width.
    pub x_fraction: f32,
    /// Centre, as a fraction of the room's height.
    pub y_fraction: f32,
}

impl Default for Deposit {
    fn default() -> Self {
        Self {
            radius_m: 1.0,
            x_fraction: 0.8,
            y_fraction: 0.5,
        }
    }
}

/// The report progress site: a rectangle at the left wall, centered in y, cut off at the border.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReportSite {
    /// Extent in x, m.
    pub width_m: f32,
    /// Extent in y, m.
    pub height_m: f32,
    /// How long it shows its changed color after a report, s.
    pub color_s: f64,
}

impl Default for ReportSite {
    fn default() -> Self {
        Self {
            width_m: 0.6,
            height_m: 3.0,
            color_s: 5.0,
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
    /// Where it starts; absent: on the report site, facing the left wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Start>,
    /// The tasks that it has behavior sets for, by name; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tasks: Vec<String>,
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

/// A rectangle on the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Lower left corner, m.
    pub x_m: f32,
    /// Lower left corner, m.
    pub y_m: f32,
    /// Extent in x, m.
    pub width_m: f32,
    /// Extent in y, m.
    pub height_m: f32,
    /// [0, 0.1] solid, (0.1, 1) slows by that factor, 1 neutral, above 1 speeds up (thesis §3.2.2.1).
    #[serde(default)]
    pub penetrability: f32,
}

/// What a task's definition says beside its behavior sets (thesis §3.3.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TaskSection {
    /// How many robots may execute it at once; 1 is exclusive.
    pub max_robots: u32,
    /// Of two sets at the threshold in the same step, the one with the higher priority activates.
    pub priority: i32,
}

impl Default for TaskSection {
    fn default() -> Self {
        Self {
            max_robots: 1,
            priority: 0,
        }
    }
}
