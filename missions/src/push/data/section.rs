//! Section `[push]` of a scenario.

use glam::Vec2;
use proto::readings::Pose;
use scenario::Scenario;
use serde::{Deserialize, Serialize};
use world_server::world::Bar;

use crate::push::bar::{BarEnd, end};

/// The parameters of a scenario's bars. The module `parameters` describes each key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushSection {
    pub length_m: f32,
    pub half_width_m: f32,
    pub stroke_m: f32,
    pub skew_m: f32,
    pub sight_m: f32,
    pub bars: Vec<BarSection>,
}

/// A bar; its axis is parallel to y at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarSection {
    pub x_m: f32,
    pub y_m: f32,
    pub goal_x_m: f32,
}

impl BarSection {
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose {
            position: Vec2::new(self.x_m, self.y_m),
            heading_rad: 0.0,
        }
    }
}

impl PushSection {
    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }

    #[must_use]
    pub fn outline(&self, pose: &Pose) -> Bar {
        let [from, to] = BarEnd::BOTH.map(|which| end(pose, which, self.length_m));
        Bar {
            from,
            to,
            half_width_m: self.half_width_m,
        }
    }

    /// Returns the name of a bar or of one of its ends.
    #[must_use]
    pub fn name_of(&self, bar: usize, end: Option<BarEnd>) -> String {
        match (self.bars.len(), end) {
            (1, None) => "bar".to_owned(),
            (1, Some(end)) => end.name().to_owned(),
            (_, None) => format!("b{bar}"),
            (_, Some(end)) => format!("b{bar}-{}", end.name()),
        }
    }
}
