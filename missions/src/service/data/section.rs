//! `[service]` of a scenario.

use alliance_proto::scenario::Scenario;
use serde::{Deserialize, Serialize};

use super::MAX_POINTS;

/// What a scenario says of its points of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServiceSection {
    /// What a task is.
    pub tasks: TasksAre,
    /// Who knows of which points.
    pub known: KnownTo,
    /// From how far a robot's center can work on a point, m.
    pub reach_m: f32,
    /// How far a robot sees points, m.
    pub sight_m: f32,
    /// Tasks that are kept for points which faults add.
    pub spare: u16,
    /// No point arrives or comes back from then on, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Whether it is meant that nobody can do some of the tasks.
    pub uncovered: bool,
    /// The kinds of work.
    pub kinds: Vec<Kind>,
    /// Points at known places.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Point>,
    /// Points that are drawn.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub random: Vec<Batch>,
}

/// What a task is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TasksAre {
    /// A point each: `serve(p7)`.
    Points,
    /// All points of a kind, the nearest first: `serve(garbage)`.
    Kinds,
}

/// Who knows of which points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KnownTo {
    /// Each robot of all that it has tasks for: there is a board.
    All,
    /// Each robot of those that it sees or hears of.
    Sight,
}

/// A kind of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kind {
    /// Its name, and that of the skill that it takes.
    pub name: String,
    /// How long a point of it takes a robot of skill 1, s.
    pub work_s: Between,
    /// How many robots can work on a point of it at once.
    #[serde(default = "one")]
    pub workers: u32,
    /// Whether work that is left unfinished stays done.
    #[serde(default = "yes")]
    pub kept: bool,
    /// How long after its arrival a point of it expires, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline_s: Option<Between>,
    /// How long after its arrival a point of it comes back, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
}

fn one() -> u32 {
    1
}

fn yes() -> bool {
    true
}

/// Numbers between two, each as likely.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Between {
    /// The least.
    pub min: f64,
    /// The most.
    pub max: f64,
}

/// A point at a known place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// What there is to do.
    pub kind: String,
    /// Where, m.
    pub x_m: f32,
    /// Where, m.
    pub y_m: f32,
    /// When it arrives, s.
    #[serde(default)]
    pub arrival_s: f64,
    /// How long it takes a robot of skill 1, s; absent: drawn as its kind says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work_s: Option<f64>,
}

/// Points that are drawn, anywhere in the room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Batch {
    /// How many.
    pub n: u16,
    /// What there is to do; absent: the kinds take turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// When they arrive, or begin to, s.
    #[serde(default)]
    pub at_s: f64,
    /// How many arrive per second on average, as a Poisson process; 0: all at once.
    #[serde(default)]
    pub rate_hz: f64,
}

impl ServiceSection {
    /// That of a scenario of this mission.
    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }

    /// The kind of that name, by its place.
    #[must_use]
    pub fn kind_named(&self, name: &str) -> Option<usize> {
        self.kinds.iter().position(|kind| kind.name == name)
    }

    /// The kind of each point, by the number of the point. It does not depend on the seed.
    pub fn kind_of_each(&self) -> impl Iterator<Item = usize> + '_ {
        // Checked: the names are those of kinds.
        let named = |name: &str| self.kind_named(name).unwrap_or_default();
        let placed = self.points.iter().map(move |point| named(&point.kind));
        let drawn = self.random.iter().flat_map(move |batch| {
            let kind = batch.kind.as_deref().map(named);
            let in_turn = move |number| kind.unwrap_or(number % self.kinds.len().max(1));
            (0..usize::from(batch.n)).map(in_turn)
        });
        // It may be asked before that is checked.
        placed.chain(drawn).take(MAX_POINTS + 1)
    }

    /// Most points that a run may have.
    #[must_use]
    pub fn most_points(&self) -> usize {
        match self.tasks {
            TasksAre::Points => self.kind_of_each().count() + usize::from(self.spare),
            TasksAre::Kinds => MAX_POINTS,
        }
    }
}
