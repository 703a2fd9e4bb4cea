//! Components: what lies or stands on the floor (thesis §3.2).

use std::fmt;

use alliance_proto::ids::RobotId;
use alliance_proto::readings::Pose;
use glam::Vec2;

use super::{Aspect, Outline};

/// A rectangle on the floor, by the order in which it was put there: the scenario's come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ObstacleId(pub u32);

/// Identity of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ComponentId {
    /// A robot.
    Robot(RobotId),
    /// An obstacle or patch.
    Obstacle(ObstacleId),
}

/// As the log has it: `obstacle-2`.
impl fmt::Display for ComponentId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(robot) => robot.fmt(f),
            Self::Obstacle(obstacle) => write!(f, "obstacle-{}", obstacle.0),
        }
    }
}

/// Extent of a component about its pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A disc about the position.
    Disc {
        /// Radius, m.
        radius_m: f32,
    },
    /// A rectangle parallel to the axes, whatever the heading (thesis §4.2.1).
    Rectangle {
        /// Half of its size in x and y, m.
        half_size_m: Vec2,
    },
}

/// Degree of penetrability (thesis §3.2.2.1): [0, 0.1] solid, (0.1, 1) slows by that factor, 1 neutral, above 1 speeds up.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Penetrability(pub f32);

impl Penetrability {
    /// The floor.
    pub const NEUTRAL: Self = Self(1.0);

    /// Whether nothing can enter.
    #[must_use]
    pub fn is_solid(self) -> bool {
        self.0 <= 0.1
    }

    /// Whether it changes the speed of what moves over it.
    #[must_use]
    pub fn changes_speed(self) -> bool {
        !self.is_solid() && self != Self::NEUTRAL
    }
}

/// Something with a place in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Identity.
    pub id: ComponentId,
    /// Position and orientation.
    pub pose: Pose,
    /// Extent.
    pub shape: Shape,
    /// Whether and how others can move over it.
    pub penetrability: Penetrability,
    /// Properties that evolve each step.
    pub aspects: Vec<Aspect>,
}

impl Component {
    /// The part of the floor that it takes up.
    #[must_use]
    pub fn outline(&self) -> Outline {
        let center = self.pose.position;
        match self.shape {
            Shape::Disc { radius_m } => Outline::Disc { center, radius_m },
            Shape::Rectangle { half_size_m } => Outline::Rectangle {
                min: center - half_size_m,
                max: center + half_size_m,
            },
        }
    }
}
