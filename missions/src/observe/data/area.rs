//! The region of the targets, as a shape.

use std::f32::consts::TAU;

use glam::Vec2;
use scenario::Scenario;

use super::{ObserveSection, Region};

/// The golden angle, rad. Successive places on a disc that differ by it spread evenly, for any number of places.
const GOLDEN_RAD: f32 = 2.399_963_2;
/// The equivalent for a square (Roberts' R2 sequence).
const PLASTIC: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Area {
    Disc { center: Vec2, radius_m: f32 },
    Rectangle { min: Vec2, max: Vec2 },
}

impl Area {
    #[must_use]
    pub fn from_scenario(scenario: &Scenario) -> Self {
        let room = scenario.room;
        match ObserveSection::from_scenario(scenario).region {
            Region::Disc => Self::Disc {
                center: room.middle(),
                radius_m: room.size().min_element() / 2.0,
            },
            Region::Room => Self::Rectangle {
                min: room.low(),
                max: room.high(),
            },
        }
    }

    /// Returns the part of the area at that distance from its edge; if it is empty, the center.
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

    #[must_use]
    pub fn contains(&self, place: Vec2) -> bool {
        match *self {
            Self::Disc { center, radius_m } => {
                place.distance_squared(center) <= radius_m * radius_m
            }
            Self::Rectangle { min, max } => place.cmpge(min).all() && place.cmple(max).all(),
        }
    }

    /// Returns the nearest place in the area, except for rounding.
    #[must_use]
    pub fn nearest(&self, place: Vec2) -> Vec2 {
        match *self {
            Self::Disc { center, radius_m } => center + (place - center).clamp_length_max(radius_m),
            Self::Rectangle { min, max } => place.clamp(min, max),
        }
    }

    /// Returns the unit vector from an outside place to the area, at a right angle to the edge; `None` for an inside
    /// place.
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

    /// Maps two numbers from 0 to 1 to a place. Uniform numbers give uniform places.
    #[must_use]
    pub fn place(&self, share: Vec2) -> Vec2 {
        match *self {
            Self::Disc { center, radius_m } => {
                center + radius_m * share.x.sqrt() * Vec2::from_angle(TAU * share.y)
            }
            Self::Rectangle { min, max } => min + share * (max - min),
        }
    }

    /// Returns `count` places, spread evenly.
    pub fn spread(&self, count: usize) -> impl Iterator<Item = Vec2> {
        let area = *self;
        (0..count).map(move |index| match area {
            Self::Disc { center, radius_m } => {
                let share = (index as f32 + 0.5) / count as f32;
                center + radius_m * share.sqrt() * Vec2::from_angle(GOLDEN_RAD * index as f32)
            }
            Self::Rectangle { .. } => area.place((0.5 + PLASTIC * (index as f32 + 1.0)).fract()),
        })
    }
}
