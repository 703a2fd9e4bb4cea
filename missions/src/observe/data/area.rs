//! The region in which targets are, as a shape.

use std::f32::consts::TAU;

use alliance_proto::scenario::Scenario;
use glam::Vec2;

use super::{ObserveSection, Region};

/// The golden angle, rad: places of a disc that turn by it spread evenly, however many they are.
const GOLDEN_RAD: f32 = 2.399_963_2;
/// The same for a square (Roberts' R2 sequence).
const PLASTIC: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);

/// A disc or a rectangle, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Area {
    /// All within that of a place.
    Disc {
        /// The place.
        center: Vec2,
        /// The distance.
        radius_m: f32,
    },
    /// All between two corners.
    Rectangle {
        /// The lower left one.
        min: Vec2,
        /// The upper right one.
        max: Vec2,
    },
}

/// The unit vector of an angle, rad.
pub fn direction(angle_rad: f32) -> Vec2 {
    Vec2::new(libm::cosf(angle_rad), libm::sinf(angle_rad))
}

impl Area {
    /// The region of a scenario.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let size = Vec2::new(scenario.room.width_m, scenario.room.height_m);
        match ObserveSection::of(scenario).region {
            Region::Disc => Self::Disc {
                center: size / 2.0,
                radius_m: size.min_element() / 2.0,
            },
            Region::Room => Self::Rectangle {
                min: Vec2::ZERO,
                max: size,
            },
        }
    }

    /// What of it is that far from its edge; where nothing is, its middle.
    #[must_use]
    pub fn inset(self, by_m: f32) -> Self {
        match self {
            Self::Disc { center, radius_m } => Self::Disc {
                center,
                radius_m: (radius_m - by_m).max(0.0),
            },
            Self::Rectangle { min, max } => {
                let by = Vec2::splat(by_m).min((max - min) / 2.0);
                Self::Rectangle {
                    min: min + by,
                    max: max - by,
                }
            }
        }
    }

    /// Whether a place is in it.
    #[must_use]
    pub fn contains(&self, place: Vec2) -> bool {
        match *self {
            Self::Disc { center, radius_m } => {
                place.distance_squared(center) <= radius_m * radius_m
            }
            Self::Rectangle { min, max } => place.cmpge(min).all() && place.cmple(max).all(),
        }
    }

    /// The nearest place that is in it, but for rounding.
    #[must_use]
    pub fn nearest(&self, place: Vec2) -> Vec2 {
        match *self {
            Self::Disc { center, radius_m } => center + (place - center).clamp_length_max(radius_m),
            Self::Rectangle { min, max } => place.clamp(min, max),
        }
    }

    /// The unit vector from a place that is not in it to the inside, at a right angle to the edge; `None` of one that is in it.
    #[must_use]
    pub fn inward(&self, place: Vec2) -> Option<Vec2> {
        if self.contains(place) {
            return None;
        }
        match *self {
            Self::Disc { center, .. } => Some((center - place).normalize_or(Vec2::X)),
            Self::Rectangle { min, max } => {
                let beyond = place.clamp(min, max) - place;
                Some(beyond.normalize_or(Vec2::X))
            }
        }
    }

    /// The place of two numbers from 0 to 1, such that all places are as likely where all numbers are.
    #[must_use]
    pub fn place(&self, share: Vec2) -> Vec2 {
        match *self {
            Self::Disc { center, radius_m } => {
                center + radius_m * share.x.sqrt() * direction(TAU * share.y)
            }
            Self::Rectangle { min, max } => min + share * (max - min),
        }
    }

    /// So many places, spread evenly.
    pub fn spread(&self, count: usize) -> impl Iterator<Item = Vec2> {
        let area = *self;
        (0..count).map(move |index| match area {
            Self::Disc { center, radius_m } => {
                let share = (index as f32 + 0.5) / count as f32;
                center + radius_m * share.sqrt() * direction(GOLDEN_RAD * index as f32)
            }
            Self::Rectangle { .. } => area.place((0.5 + PLASTIC * (index as f32 + 1.0)).fract()),
        })
    }
}
