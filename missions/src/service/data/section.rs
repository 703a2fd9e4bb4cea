//! The section `[service]` of a scenario file.

use std::collections::{BTreeMap, BTreeSet};
use std::iter;

use glam::Vec2;
use scenario::Scenario;
use serde::{Deserialize, Serialize};

use super::MAX_POINTS;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServiceSection {
    pub tasks: TaskGranularity,
    /// The source of the robots' knowledge about points.
    pub known: KnowledgeSource,
    pub reach_m: f32,
    pub sight_m: f32,
    pub spare: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    pub uncovered: bool,
    #[serde(default, skip_serializing_if = "CostMeasure::is_line")]
    pub costs: CostMeasure,
    /// The longest time that a robot waits at a point for the robots of the other slots, s. By default 30.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coalition_wait_s: Option<f64>,
    /// The share of the capacity at which a robot drives to a charger. By default 0.2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reserve: Option<f64>,
    pub kinds: Vec<Kind>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Point>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub random: Vec<RandomPoints>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chargers: Vec<Charger>,
}

/// A place at which robots without a task charge their batteries.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Charger {
    pub x_m: f32,
    pub y_m: f32,
    /// The power for each robot, W.
    pub rate_w: f64,
    /// The number of robots that charge at once.
    #[serde(default = "one")]
    pub slots: u32,
}

impl Charger {
    #[must_use]
    pub fn place(&self) -> Vec2 {
        Vec2::new(self.x_m, self.y_m)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TaskGranularity {
    /// One point per task: `serve(p7)`.
    Points,
    /// All points of a kind, the nearest first: `serve(garbage)`.
    Kinds,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KnowledgeSource {
    /// A board, which announces to each robot all points of its tasks.
    All,
    /// The robot's own sight and messages of teammates.
    Sight,
}

/// The way by which robots estimate the cost of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CostMeasure {
    /// The length of the straight line.
    #[default]
    Line,
    /// The shortest way around the solid obstacles, which robots receive as a map.
    Path,
}

impl CostMeasure {
    // Serde passes a reference.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    fn is_line(&self) -> bool {
        *self == Self::Line
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kind {
    pub name: String,
    pub work_s: Interval,
    #[serde(default = "one")]
    pub workers: u32,
    #[serde(default = "yes")]
    pub kept: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline_s: Option<Interval>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
}

fn one() -> u32 {
    1
}

fn yes() -> bool {
    true
}

/// A range from which values are drawn uniformly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    pub min: f64,
    pub max: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// The name by which other points refer to this one. `p0`, `p1` and so on are always known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    pub kind: String,
    pub x_m: f32,
    pub y_m: f32,
    #[serde(default)]
    pub arrival_s: f64,
    /// The work for a robot of skill 1, s. By default drawn as for its kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work_s: Option<f64>,
    /// The time from the arrival to the earliest work, s. Robots receive it with the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opens_s: Option<f64>,
    /// The time from the arrival to expiration, s. By default drawn as for its kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline_s: Option<f64>,
    /// The reward of the point if it is done in its window. By default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The priority of its task; a higher one goes first. By default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub priority: Option<i32>,
    /// The names of the points that must be done before this one arrives.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub after: Vec<String>,
    /// The numbers of robots by skill that work together. By default any robot with the skill of the kind works alone.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub needs: BTreeMap<String, u32>,
    /// The place to which the robot that has done the work delivers its result, m. By default nothing is delivered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deliver_to: Option<[f32; 2]>,
    /// The part of a robot's capacity that the point takes: up to the delivery, or for the rest of the run. By default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub demand: Option<f64>,
}

impl Point {
    /// Returns whether robots with several skills, or several robots, must work together.
    #[must_use]
    pub fn has_needs(&self) -> bool {
        !self.needs.is_empty()
    }

    /// Returns whether the point has a property beyond place, kind, arrival and work.
    fn has_properties(&self) -> bool {
        self.name.is_some()
            || self.opens_s.is_some()
            || self.deadline_s.is_some()
            || self.value.is_some()
            || self.priority.is_some()
            || !self.after.is_empty()
            || !self.needs.is_empty()
            || self.deliver_to.is_some()
            || self.demand.is_some()
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomPoints {
    pub n: u32,
    /// The name of their kind. By default the kinds take turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// The time of their arrival, or of the first possible arrival, s.
    #[serde(default)]
    pub at_s: f64,
    /// The mean number of arrivals per second, as a Poisson process. 0: all at once.
    #[serde(default)]
    pub rate_hz: f64,
}

impl ServiceSection {
    /// The default of `coalition_wait_s`, s.
    pub const COALITION_WAIT_S: f64 = 30.0;

    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }

    #[must_use]
    pub fn kind_named(&self, name: &str) -> Option<usize> {
        self.kinds.iter().position(|kind| kind.name == name)
    }

    /// Returns whether any point states a property of its task: a name, a window, a value or a priority. Log and results
    /// then contain the properties.
    #[must_use]
    pub fn has_properties(&self) -> bool {
        self.points.iter().any(Point::has_properties)
    }

    /// Returns the kind of each point, by number. It does not depend on the seed.
    pub fn kinds_of_points(&self) -> impl Iterator<Item = usize> + use<> {
        // The first of equal names counts, until the check of the scenario refuses the others.
        let kinds = self.kinds.iter().enumerate().rev();
        let by_name: BTreeMap<&str, usize> = kinds
            .map(|(index, kind)| (kind.name.as_str(), index))
            .collect();
        // The check of the scenario guarantees that the names exist.
        let named = |name: &str| by_name.get(name).copied().unwrap_or_default();
        let placed = self.points.iter().map(|point| named(&point.kind));
        let drawn = self.random.iter().flat_map(|batch| {
            let kind = batch.kind.as_deref().map(named);
            let in_turn = move |number| kind.unwrap_or(number % self.kinds.len().max(1));
            (0..batch.n as usize).map(in_turn)
        });
        // The limit keeps this short for a scenario that is not yet checked.
        let kinds: Vec<usize> = placed.chain(drawn).take(MAX_POINTS + 1).collect();
        kinds.into_iter()
    }

    /// Returns the priority of a point, 0 unless stated.
    #[must_use]
    pub fn priority(&self, point: usize) -> i32 {
        let point = self.points.get(point);
        point.and_then(|point| point.priority).unwrap_or_default()
    }

    /// Returns the skills that a point of a kind requires, one for each robot that it needs at once.
    pub fn skills_of(&self, point: u32, kind: usize) -> impl Iterator<Item = &String> {
        let needs = self.points.get(point as usize).map(|point| &point.needs);
        let needs = needs.filter(|needs| !needs.is_empty());
        let alone = needs.is_none().then_some(&self.kinds[kind].name);
        let needs = needs.into_iter().flatten();
        needs
            .flat_map(|(skill, count)| iter::repeat_n(skill, *count as usize))
            .chain(alone)
    }

    /// Returns the names of all skills: those of the kinds, then those that only needs of points contain.
    #[must_use]
    pub fn skills(&self) -> Vec<String> {
        let kinds: BTreeSet<&str> = self.kinds.iter().map(|kind| kind.name.as_str()).collect();
        let needed = self.points.iter().flat_map(|point| point.needs.keys());
        let needed: BTreeSet<&String> = needed
            .filter(|name| !kinds.contains(name.as_str()))
            .collect();
        let of_kinds = self.kinds.iter().map(|kind| &kind.name);
        of_kinds.chain(needed).cloned().collect()
    }

    #[must_use]
    pub fn max_points(&self) -> usize {
        match self.tasks {
            TaskGranularity::Points => self.kinds_of_points().count() + self.spare as usize,
            TaskGranularity::Kinds => MAX_POINTS,
        }
    }
}
