use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec2;

/// The direction of a wall. Both search behaviors visit the walls in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compass {
    West,
    North,
    East,
    South,
}

impl Compass {
    pub const CLOCKWISE: [Self; 4] = [Self::West, Self::North, Self::East, Self::South];

    pub fn vector(self) -> Vec2 {
        match self {
            Self::West => Vec2::NEG_X,
            Self::North => Vec2::Y,
            Self::East => Vec2::X,
            Self::South => Vec2::NEG_Y,
        }
    }

    pub fn heading(self) -> f32 {
        match self {
            Self::West => PI,
            Self::North => FRAC_PI_2,
            Self::East => 0.0,
            Self::South => -FRAC_PI_2,
        }
    }
}
