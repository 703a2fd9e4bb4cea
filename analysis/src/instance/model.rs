//! A task allocation problem, independent of its file format and of the mission: tasks, robots and, after a run, the
//! result.
//!
//! Keys have the names and meanings of scenario files. The JSON form is published as `docs/instance.schema.json`.

use std::collections::BTreeMap;

use scenario::{Obstacle, Room};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A task allocation problem: tasks, robots and, after a run, its result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Instance {
    /// The name of the problem.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// The simulated time after which a run ends, s. By default it is the time that one robot needs for all tasks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_s: Option<f64>,
    /// The top speed of robots that state none, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f64>,
    /// The top turn rate of all robots, degrees per second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_deg_s: Option<f64>,
    /// The penetrability of robots to each other: 0 is solid, and with 1 they do not block each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot_penetrability: Option<f64>,
    /// The maximum distance from which a robot can work on a task, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reach_m: Option<f64>,
    /// The floor. Absent: a floor around all places, which an import shifts and scales if no room contains them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room: Option<Floor>,
    /// The tasks, in the order of the points p0, p1, … of a scenario.
    pub tasks: Vec<Task>,
    /// The team, in rank order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robots: Vec<Robot>,
    /// Rectangles on the floor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Obstacle>,
    /// The result of the run from which the instance was exported.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result: Option<RunResult>,
}

/// A rectangular floor and its frame of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// The x coordinate of the lower left corner, m.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub x_m: f64,
    /// The y coordinate of the lower left corner, m.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub y_m: f64,
    /// Extent in x, m.
    pub width_m: f64,
    /// Extent in y, m.
    pub height_m: f64,
}

impl Floor {
    /// Returns the floor in the precision of a scenario.
    #[must_use]
    pub fn as_room(&self) -> Room {
        Room {
            x_m: self.x_m as f32,
            y_m: self.y_m as f32,
            width_m: self.width_m as f32,
            height_m: self.height_m as f32,
        }
    }
}

/// A task at a place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// The name, unique in the instance.
    pub id: String,
    /// The x coordinate, m.
    pub x_m: f64,
    /// The y coordinate, m.
    pub y_m: f64,
    /// The work for a robot of skill 1, s.
    pub work_s: f64,
    /// The time at which robots learn of the task, s.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub arrival_s: f64,
    /// The time from the arrival to the earliest work, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opens_s: Option<f64>,
    /// The time from the arrival to the expiration, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline_s: Option<f64>,
    /// The name of the required skill. Absent: each robot can do the task, unless `needs` states skills.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// The number of robots that can work on the task at once; 1 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub workers: Option<u32>,
    /// The skills that the task needs at once, each with a number of robots.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub needs: BTreeMap<String, u32>,
    /// The value that counts when the task is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The priority; a larger one comes first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub priority: Option<i64>,
    /// The ids of the tasks that must be done before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub after: Vec<String>,
    /// The place to which a robot delivers what it picks up at the task, x and y, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deliver_to: Option<[f64; 2]>,
    /// The part of a robot's capacity that the task takes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub demand: Option<f64>,
}

impl Task {
    /// Returns the demand that a robot of the mission takes: one above 0, of a task for one robot.
    #[must_use]
    pub fn load(&self) -> Option<f64> {
        let is_alone = self.needs.is_empty() && self.workers.unwrap_or(1) == 1;
        self.demand.filter(|demand| *demand > 0.0 && is_alone)
    }
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// A robot of the team.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// The unique name: at most 32 letters, digits, '-' and '_'.
    pub id: String,
    /// The x coordinate of the start, m. Absent: a start of the mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x_m: Option<f64>,
    /// The y coordinate of the start, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y_m: Option<f64>,
    /// The top speed, m/s; absent uses the team's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f64>,
    /// The levels of its skills by name, 0 to 1000. Absent: every skill at level 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skills: Option<BTreeMap<String, f64>>,
    /// The total demand that it can carry at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capacity: Option<f64>,
}

/// The assignment and the times of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunResult {
    /// The allocators of the team, separated by commas.
    pub allocator: String,
    pub seed: u64,
    /// The outcome of the run, such as "complete".
    pub outcome: String,
    /// The time of the last tick, s.
    pub end_s: f64,
    /// The time at which the last task was done, s. Absent unless the mission is complete.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub makespan_s: Option<f64>,
    /// The sum of the values of all tasks that are done. A task without a value counts 1.
    pub value: f64,
    /// The tasks, in the order of the instance.
    pub tasks: Vec<TaskResult>,
    /// The robots, in rank order.
    pub robots: Vec<RobotResult>,
}

/// The state of a task at the end of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TaskState {
    /// Neither done nor expired, or not arrived.
    #[default]
    Open,
    /// Completed before its expiration.
    Done,
    /// Expired before its completion.
    Expired,
}

/// The assignment and the times of a task.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TaskResult {
    /// The id of the task.
    pub id: String,
    /// The state at the end of the run.
    pub state: TaskState,
    /// The robots that worked on the task, in the order of their first work.
    pub robots: Vec<String>,
    /// The time of the first work, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub begun_s: Option<f64>,
    /// The time of completion or expiration, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_s: Option<f64>,
}

/// The work of a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotResult {
    /// The id of the robot.
    pub id: String,
    /// The tasks on which it worked, in the order of its first work on each.
    pub tasks: Vec<String>,
}

/// Returns the JSON Schema (draft 2020-12) of an instance.
#[must_use]
pub fn schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(Instance).to_value();
    schema["title"] = "Instance of alliance-sim".into();
    schema
}
