//! Snapshots of a run for observers (key `view`). The progress line, the live page and the exports of finished runs use
//! them.
//!
//! A snapshot contains everything visible that can change during a run. The constant data is in the run's
//! [`scenario::Setup`].

use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::control::{AgentState, ClockStatus, FaultStatus};
use crate::readings::{Pose, Readings};
use crate::telemetry::{BehaviorState, Motivation, Reception};
use crate::tick::Outcome;
use scenario::Obstacle;
use scenario::ids::{BehaviorId, Incarnation, ItemId, RobotId, Tick};
use scenario::time::SimTime;

/// The largest number of messages in a view. The newest ones are kept.
pub const MESSAGES_MAX: usize = 256;

/// The largest number of marks in a view. The limit keeps a view below the size limit of a message.
pub const MARKS_MAX: usize = 600;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct View {
    pub tick: Tick,
    pub now: SimTime,
    /// The step clock; `None` for a run that is shown from its log.
    pub clock: Option<ClockStatus>,
    /// The current values of mission.csv, in the order of its columns.
    pub mission: Vec<Option<f64>>,
    /// The items that robots can carry, by id.
    pub items: Vec<ItemView>,
    /// The rectangles on the floor, solid or not, in the order in which they were added.
    pub obstacles: Vec<Obstacle>,
    /// Other visible objects of the mission, at most [`MARKS_MAX`].
    pub marks: Vec<Mark>,
    pub robots: Vec<RobotView>,
    pub faults: Vec<FaultStatus>,
    /// The deliveries since the previous view, at most the newest [`MESSAGES_MAX`].
    pub messages: Vec<MessageView>,
    pub messages_left_out: u64,
    /// The corners of the motivation curves since the previous view, by time for each robot. The first view contains
    /// none.
    pub corners: Vec<Corner>,
    /// The outcome of the run in the last view; `None` before.
    pub outcome: Option<Outcome>,
}

impl View {
    /// Adds a mark if there is space for it. Add important marks first.
    pub fn mark(&mut self, mark: Mark) {
        if self.marks.len() < MARKS_MAX {
            self.marks.push(mark);
        }
    }
}

/// A visible object of a mission, in a form that is independent of the mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Mark {
    /// The identifier, constant over all views. If there are several kinds of marks, it begins with the number of the
    /// kind, which selects the color: `2/p7`.
    pub id: String,
    pub outline: MarkOutline,
    pub role: MarkRole,
    /// The work at the place, whose rest is shown as its filling; `None` if it does not apply.
    pub work: Option<Work>,
    /// The name for people, possibly empty.
    pub label: String,
}

/// The work at a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Work {
    /// The amount that is left, from 0 to `all`.
    pub left: f32,
    /// The whole amount, above 0.
    pub all: f32,
    /// The unit of both amounts, such as `items` or `s`; empty for work that is either left or done.
    pub unit: String,
}

impl Work {
    /// Creates an amount of work; `None` without any work.
    #[must_use]
    pub fn new(left: f32, all: f32, unit: &str) -> Option<Self> {
        (all > 0.0).then(|| Self {
            left,
            all,
            unit: unit.to_owned(),
        })
    }

    /// Creates work that is either left or done.
    #[must_use]
    pub fn left_or_done(is_left: bool) -> Option<Self> {
        Self::new(f32::from(u8::from(is_left)), 1.0, "")
    }
}

impl Mark {
    /// Returns the share of the work that is left, from 0 to 1; 0 without work.
    #[must_use]
    pub fn share_left(&self) -> f32 {
        let work = self.work.as_ref();
        work.map_or(0.0, |work| (work.left / work.all).clamp(0.0, 1.0))
    }

    /// Returns whether the label is shown among so many marks. In a crowd, only large marks have labels.
    #[must_use]
    pub fn is_labelled(&self, among: usize) -> bool {
        const CROWD: usize = 60;
        const SMALL_M: f32 = 0.3;
        let is_small =
            matches!(self.outline, MarkOutline::Disc { radius_m, .. } if radius_m < SMALL_M);
        let has_room = !is_small || among <= CROWD;
        has_room && !self.label.is_empty()
    }

    /// Returns the number of the kind, if there are several.
    #[must_use]
    pub fn kind(&self) -> Option<usize> {
        self.id.split_once('/')?.0.parse().ok()
    }

    /// Creates a disc without work and without a label.
    #[must_use]
    pub fn disc(id: String, center: Vec2, radius_m: f32, role: MarkRole) -> Self {
        Self {
            id,
            outline: MarkOutline::Disc { center, radius_m },
            role,
            work: None,
            label: String::new(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MarkOutline {
    Disc {
        #[schemars(with = "[f32; 2]")]
        center: Vec2,
        radius_m: f32,
    },
    Rectangle {
        #[schemars(with = "[f32; 2]")]
        min: Vec2,
        #[schemars(with = "[f32; 2]")]
        max: Vec2,
    },
    /// A bar with round ends.
    Bar {
        #[schemars(with = "[f32; 2]")]
        from: Vec2,
        #[schemars(with = "[f32; 2]")]
        to: Vec2,
        half_width_m: f32,
    },
    Line {
        #[schemars(with = "[f32; 2]")]
        from: Vec2,
        #[schemars(with = "[f32; 2]")]
        to: Vec2,
    },
}

impl MarkOutline {
    /// Returns the place above which the label of the mark is written, m: the top, or the middle of a bar or line.
    #[must_use]
    pub fn label_place(&self) -> Vec2 {
        match *self {
            Self::Disc { center, radius_m } => center + Vec2::new(0.0, radius_m),
            Self::Rectangle { min, max } => Vec2::new((min.x + max.x) / 2.0, max.y),
            Self::Bar { from, to, .. } | Self::Line { from, to } => (from + to) / 2.0,
        }
    }
}

/// The role of a mark. Observers use one color per role.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MarkRole {
    /// An object that robots take.
    Item,
    /// An object that robots search or observe.
    Target,
    /// A place with objects or work.
    Zone,
    /// The destination of an object.
    Goal,
    /// The range of an object.
    Range,
    /// A connection between objects.
    Link,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ItemView {
    /// The position, m. For a carried item, the place where it was picked up.
    #[schemars(with = "[f32; 2]")]
    pub position: Vec2,
    pub carrier: Option<RobotId>,
    /// Half of the item's size, m.
    pub radius_m: f32,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotView {
    pub state: AgentState,
    /// The incarnation of the agent, if it is alive.
    pub incarnation: Option<Incarnation>,
    /// The process id of the agent; `None` in views from a log.
    pub pid: Option<u32>,
    pub pose: Pose,
    /// The speed in the last step, m/s.
    pub speed_m_s: f32,
    pub carrying: Option<ItemId>,
    /// The remaining energy, J; `None` if energy is not simulated.
    pub energy_j: Option<f32>,
    /// The latest sensor readings, including faulty ones.
    pub readings: Readings,
    /// The positions that devices of the mission detected, in the robot's frame, m.
    #[schemars(with = "Vec<[f32; 2]>")]
    pub sensed: Vec<Vec2>,
    pub active: Option<BehaviorId>,
    /// The unit of the levels of the robot's behavior sets.
    pub measure: LevelUnit,
    /// The behavior sets as last reported, in the order of the catalog.
    pub sets: Vec<BehaviorView>,
}

/// The quantity that an allocator computes for each behavior set, and that its curve shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LevelUnit {
    /// Motivations: a set becomes active at the threshold.
    #[default]
    Motivation,
    /// Utilities of tasks, in the allocator's own unit.
    Utility,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BehaviorView {
    /// The motivation with its factors and state. For allocators without motivations it contains the utility of the
    /// task, or 0 while the task is not applicable.
    pub motivation: Motivation,
    /// The time since which the set has been in this state.
    pub since: SimTime,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MessageView {
    pub receiver: RobotId,
    pub reception: Reception,
}

/// A corner of the curve of a motivation or utility. The curve is a straight line between two corners, except for a
/// reset, which is a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Corner {
    pub robot: RobotId,
    pub set: BehaviorId,
    /// The time of the step, as in motivations.csv.
    pub at: SimTime,
    pub level: f64,
    /// The state at the end of the step, valid until the next corner.
    pub state: BehaviorState,
    /// `true` if the curve ends here, because the robot did not take part in the next step.
    pub last: bool,
}
