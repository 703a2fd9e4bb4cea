//! The section `[service]` of a scenario file.

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
    pub spare: u16,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    pub uncovered: bool,
    pub kinds: Vec<Kind>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Point>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub random: Vec<RandomPoints>,
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

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    pub kind: String,
    pub x_m: f32,
    pub y_m: f32,
    #[serde(default)]
    pub arrival_s: f64,
    /// The work for a robot of skill 1, s. By default drawn as for its kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work_s: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomPoints {
    pub n: u16,
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
    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }

    #[must_use]
    pub fn kind_named(&self, name: &str) -> Option<usize> {
        self.kinds.iter().position(|kind| kind.name == name)
    }

    /// Returns the kind of each point, by number. It does not depend on the seed.
    pub fn kinds_of_points(&self) -> impl Iterator<Item = usize> + '_ {
        // The check of the scenario guarantees that the names exist.
        let named = |name: &str| self.kind_named(name).unwrap_or_default();
        let placed = self.points.iter().map(move |point| named(&point.kind));
        let drawn = self.random.iter().flat_map(move |batch| {
            let kind = batch.kind.as_deref().map(named);
            let in_turn = move |number| kind.unwrap_or(number % self.kinds.len().max(1));
            (0..usize::from(batch.n)).map(in_turn)
        });
        // The limit keeps this short for a scenario that is not yet checked.
        placed.chain(drawn).take(MAX_POINTS + 1)
    }

    #[must_use]
    pub fn max_points(&self) -> usize {
        match self.tasks {
            TaskGranularity::Points => self.kinds_of_points().count() + usize::from(self.spare),
            TaskGranularity::Kinds => MAX_POINTS,
        }
    }
}
