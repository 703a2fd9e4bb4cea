//! `[push]` of a scenario.

use alliance_proto::readings::Pose;
use alliance_proto::scenario::Scenario;
use glam::Vec2;
use serde::{Deserialize, Serialize};
use world_server::world::Bar;

use crate::push::bar::{End, end};

/// What a scenario says of its bars.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushSection {
    /// Length of each bar's axis, m.
    pub length_m: f32,
    /// Half of the thickness of each bar, m.
    pub half_width_m: f32,
    /// How far an end comes forward in a stroke, m.
    pub stroke_m: f32,
    /// How far the ends of a bar may be apart toward the goal, m.
    pub skew_m: f32,
    /// From how far a robot sees a bar, m.
    pub sight_m: f32,
    /// The bars.
    pub bars: Vec<BarSection>,
}

/// A bar, upright at first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarSection {
    /// Its middle, m.
    pub x_m: f32,
    /// Its middle, m.
    pub y_m: f32,
    /// The line that both of its ends are to cross, m.
    pub goal_x_m: f32,
}

impl BarSection {
    /// Where it is at first.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose {
            position: Vec2::new(self.x_m, self.y_m),
            heading_rad: 0.0,
        }
    }
}

impl PushSection {
    /// That of a scenario of this mission.
    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }

    /// The solid that a bar is.
    #[must_use]
    pub fn outline(&self, pose: &Pose) -> Bar {
        let [from, to] = End::BOTH.map(|which| end(pose, which, self.length_m));
        Bar {
            from,
            to,
            half_width_m: self.half_width_m,
        }
    }

    /// What people call a bar, or an end of it.
    #[must_use]
    pub fn name_of(&self, bar: usize, end: Option<End>) -> String {
        match (self.bars.len(), end) {
            (1, None) => "bar".to_owned(),
            (1, Some(end)) => end.name().to_owned(),
            (_, None) => format!("b{bar}"),
            (_, Some(end)) => format!("b{bar}-{}", end.name()),
        }
    }
}
