//! Components: objects on the floor (thesis §3.2).

use std::fmt;

use glam::Vec2;
use proto::readings::Pose;
use scenario::ids::RobotId;

use super::Outline;

/// The number of a rectangle on the floor, in the order of placement. The rectangles of the scenario come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ObstacleId(pub u32);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ComponentId {
    Robot(RobotId),
    Obstacle(ObstacleId),
}

/// The form in the log, for example `obstacle-2`.
impl fmt::Display for ComponentId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(robot) => robot.fmt(f),
            Self::Obstacle(obstacle) => write!(f, "obstacle-{}", obstacle.0),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A disc round the position.
    Disc { radius_m: f32 },
    /// A rectangle parallel to the axes, independent of the heading (thesis §4.2.1).
    Rectangle {
        /// Half of the size in x and y, m.
        half_size_m: Vec2,
    },
}

/// The degree of penetrability (thesis §3.2.2.1): [0, 0.1] is solid, (0.1, 1) slows by that factor, 1 is neutral, above 1
/// speeds up.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Penetrability(pub f32);

impl Penetrability {
    /// The value of the bare floor.
    pub const NEUTRAL: Self = Self(1.0);

    /// Checks whether nothing can enter the component.
    #[must_use]
    pub fn is_solid(self) -> bool {
        self.0 <= scenario::Obstacle::SOLID
    }

    /// Checks whether the component changes the speed of bodies on it.
    #[must_use]
    pub fn changes_speed(self) -> bool {
        !self.is_solid() && self != Self::NEUTRAL
    }
}

/// An object with a place in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    pub id: ComponentId,
    pub pose: Pose,
    pub shape: Shape,
    /// The effect on bodies that move over the component.
    pub penetrability: Penetrability,
}

impl Component {
    /// Returns the area of the floor that the component covers.
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
