//! A snapshot of the run for eyes (DESIGN §3, key `view`): what the progress line and the live page show, what a finished run
//! is shown and exported from.
//!
//! Everything that can change during a run and can be seen is in it; what cannot change is in the run's
//! [`crate::scenario::Setup`].

use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::control::{AgentState, ClockStatus, FaultStatus};
use crate::ids::{BehaviorId, Incarnation, ItemId, RobotId, Tick};
use crate::readings::{Pose, Readings};
use crate::scenario::Obstacle;
use crate::telemetry::{BehaviorState, Motivation, Reception};
use crate::tick::Outcome;
use crate::time::SimTime;

/// Messages that a view tells at most: the newest.
pub const MESSAGES_MAX: usize = 256;

/// Marks that a view has at most: it has to fit into a message.
pub const MARKS_MAX: usize = 600;

/// What an observer sees.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct View {
    /// The tick under way: those before it are finished.
    pub tick: Tick,
    /// Its simulated time.
    pub now: SimTime,
    /// The step clock; `None` of a run that is shown from its log.
    pub clock: Option<ClockStatus>,
    /// The values of mission.csv now, in the order of its columns.
    pub mission: Vec<Option<f64>>,
    /// All items that robots can carry, by id.
    pub items: Vec<ItemView>,
    /// All rectangles on the floor, solid and not, in the order in which they were put there.
    pub obstacles: Vec<Obstacle>,
    /// What else there is to see of the mission, [`MARKS_MAX`] at most.
    pub marks: Vec<Mark>,
    /// One entry per robot, by rank.
    pub robots: Vec<RobotView>,
    /// Faults that are armed or in force.
    pub faults: Vec<FaultStatus>,
    /// What has become of messages since the view before, the newest [`MESSAGES_MAX`] of them.
    pub messages: Vec<MessageView>,
    /// How many more there were.
    pub messages_left_out: u64,
    /// Where curves of motivations have bent since the view before, by time for each robot; none in the first view.
    pub bends: Vec<Bend>,
    /// How the run ended, once it has: such a view is the last one.
    pub outcome: Option<Outcome>,
}

impl View {
    /// Adds a mark, if there is room for it: the important ones come first.
    pub fn mark(&mut self, mark: Mark) {
        if self.marks.len() < MARKS_MAX {
            self.marks.push(mark);
        }
    }
}

/// Something of a mission that can be seen, for eyes that do not know the mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Mark {
    /// What tells it from the others; the same in every view. Marks of several kinds begin with the number of their kind, which has a
    /// color of its own: `2/p7`.
    pub id: String,
    /// Where it is.
    pub outline: MarkOutline,
    /// What it is there for.
    pub role: MarkRole,
    /// How much of it is done, 0 to 1; `None`: that means nothing here.
    pub share: Option<f32>,
    /// What people call it; may be empty.
    pub label: String,
}

impl Mark {
    /// Whether its label can be read among so many marks: where they are a crowd, only those of large ones.
    #[must_use]
    pub fn is_labelled(&self, among: usize) -> bool {
        const CROWD: usize = 60;
        const SMALL_M: f32 = 0.3;
        let is_small =
            matches!(self.outline, MarkOutline::Disc { radius_m, .. } if radius_m < SMALL_M);
        let has_room = !is_small || among <= CROWD;
        has_room && !self.label.is_empty()
    }

    /// The number of its kind, where there are several.
    #[must_use]
    pub fn kind(&self) -> Option<usize> {
        self.id.split_once('/')?.0.parse().ok()
    }

    /// A disc: what of it is done means nothing, and it has no name.
    #[must_use]
    pub fn disc(id: String, center: Vec2, radius_m: f32, role: MarkRole) -> Self {
        Self {
            id,
            outline: MarkOutline::Disc { center, radius_m },
            role,
            share: None,
            label: String::new(),
        }
    }
}

/// The outline of a mark, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MarkOutline {
    /// A disc.
    Disc {
        /// Its center.
        #[schemars(with = "[f32; 2]")]
        center: Vec2,
        /// Its radius.
        radius_m: f32,
    },
    /// A rectangle parallel to the axes.
    Rectangle {
        /// Lower left corner.
        #[schemars(with = "[f32; 2]")]
        min: Vec2,
        /// Upper right corner.
        #[schemars(with = "[f32; 2]")]
        max: Vec2,
    },
    /// A bar with round ends.
    Bar {
        /// One end.
        #[schemars(with = "[f32; 2]")]
        from: Vec2,
        /// The other end.
        #[schemars(with = "[f32; 2]")]
        to: Vec2,
        /// Half of its thickness.
        half_width_m: f32,
    },
    /// A line.
    Line {
        /// One end.
        #[schemars(with = "[f32; 2]")]
        from: Vec2,
        /// The other end.
        #[schemars(with = "[f32; 2]")]
        to: Vec2,
    },
}

/// What a mark is there for: eyes have a color for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MarkRole {
    /// Something that robots take.
    Item,
    /// Something that robots look for or watch.
    Target,
    /// A place where something is, or is to be done.
    Zone,
    /// Where something is to be brought.
    Goal,
    /// How far something reaches.
    Range,
    /// What belongs together.
    Link,
}

/// An item.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ItemView {
    /// Where it lies, m; while it is carried, where it was picked up.
    #[schemars(with = "[f32; 2]")]
    pub position: Vec2,
    /// Who carries it.
    pub carrier: Option<RobotId>,
    /// Half its size, m.
    pub radius_m: f32,
}

/// One robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotView {
    /// What its agent is up to.
    pub state: AgentState,
    /// Incarnation of its agent, if it has one that is alive.
    pub incarnation: Option<Incarnation>,
    /// Process id of its agent, if it has one and is not shown from a log.
    pub pid: Option<u32>,
    /// Where its body is.
    pub pose: Pose,
    /// How fast it moved in the last step, m/s.
    pub speed_m_s: f32,
    /// What it carries.
    pub carrying: Option<ItemId>,
    /// Energy left, J; `None` where energy is not simulated.
    pub energy_j: Option<f32>,
    /// What its sensors told it last, broken ones as they are.
    pub readings: Readings,
    /// Where devices of the mission's own tell that something is, in the robot's frame, m.
    #[schemars(with = "Vec<[f32; 2]>")]
    pub sensed: Vec<Vec2>,
    /// Active behavior set.
    pub active: Option<BehaviorId>,
    /// What the levels of its behavior sets are.
    pub measure: Measure,
    /// Its behavior sets as last reported, in the order of the catalog.
    pub sets: Vec<BehaviorView>,
}

/// What an allocator computes for each behavior set, and what is drawn as its curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// Motivations, which become active at the threshold.
    #[default]
    Motivation,
    /// Utilities of tasks, in a measure of the allocator's own.
    Utility,
}

/// A behavior set of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BehaviorView {
    /// Its motivation, with its factors and its state; the utility of its task in its place where there are no motivations, 0
    /// while that is not applicable.
    pub motivation: Motivation,
    /// Since when it is in that state.
    pub since: SimTime,
}

/// What became of a message at a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MessageView {
    /// At whom.
    pub receiver: RobotId,
    /// The message and its delivery.
    pub reception: Reception,
}

/// A corner of the curve of a motivation or a utility. Between two corners the curve is a straight line, but for a reset, which is a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bend {
    /// Whose.
    pub robot: RobotId,
    /// Of which behavior set.
    pub set: BehaviorId,
    /// Time of the step, as in motivations.csv.
    pub at: SimTime,
    /// The motivation or utility at its end.
    pub level: f64,
    /// The state at its end, until the next corner.
    pub state: BehaviorState,
    /// Whether the curve ends here, for the robot took no part in the step after it.
    pub last: bool,
}
