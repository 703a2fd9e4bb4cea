//! The waste that a robot senses outside the deposit, and how far it can be sure that there is no more.

use alliance_proto::readings::{Readings, SensedWaste, WASTE_MOST};
use glam::Vec2;

use super::briefing::Briefing;
use super::map::Places;
use crate::body::goal::length;

/// One step's view of the floor.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sight {
    pub position: Vec2,
    /// Unit vector of the heading.
    pub ahead: Vec2,
    /// Waste outside the deposit, nearest first, m.
    pub waste: SensedWaste,
    /// Up to here all waste is seen, m.
    range: f32,
}

impl Sight {
    /// What the readings show; `None` without position or waste sensor.
    pub fn of(readings: &Readings, briefing: &Briefing, places: &Places) -> Option<Self> {
        let (pose, sensed) = (readings.pose?, readings.waste.as_ref()?);
        let ahead = Vec2::new(libm::cosf(pose.heading_rad), libm::sinf(pose.heading_rad));
        let items = sensed
            .iter()
            .map(|offset| pose.position + ahead * offset.x + ahead.perp() * offset.y);
        let farthest = sensed.last().filter(|_| sensed.len() >= WASTE_MOST);
        Some(Self {
            position: pose.position,
            ahead,
            waste: items
                .filter(|&item| {
                    length(item - places.nearest_deposit(item)) > briefing.deposit_radius_m
                })
                .collect(),
            range: farthest.map_or(briefing.sight_m, |farthest| length(*farthest)),
        })
    }

    /// The item seen within `slack` of that place.
    pub fn item_at(&self, place: Vec2, slack: f32) -> Option<Vec2> {
        let mut items = self.waste.iter().copied();
        items.find(|&item| length(item - place) < slack)
    }

    /// Whether all waste within `around` of that place is seen.
    pub fn covers(&self, place: Vec2, around: f32) -> bool {
        length(place - self.position) + around < self.range
    }

    /// Whether nothing lies within `slack` of that place, for certain.
    pub fn shows_nothing_at(&self, place: Vec2, slack: f32) -> bool {
        self.covers(place, slack) && self.item_at(place, slack).is_none()
    }
}
