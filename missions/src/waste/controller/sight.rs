//! The waste that a robot senses outside the deposits, and the area in which it is certain that there is no more.

use glam::Vec2;
use proto::mission::items::{MAX_SENSED_ITEMS, SensedItems};
use proto::readings::Readings;

use super::briefing::Briefing;
use super::map::KnownPlaces;
use robot_agent::body::goal::{is_shorter, is_within, length};

#[derive(Clone, Debug, PartialEq)]
pub(super) struct FloorView {
    pub position: Vec2,
    pub ahead: Vec2,
    /// The waste outside the deposits, nearest first, m.
    pub waste: SensedItems,
    /// The distance up to which all waste is seen, m.
    range: f32,
}

impl FloorView {
    /// Creates the view from the readings, for the heading vector `ahead`. Returns `None` without position or waste
    /// sensor.
    pub fn of(
        readings: &Readings,
        ahead: Vec2,
        briefing: &Briefing,
        places: &KnownPlaces,
    ) -> Option<Self> {
        let (pose, sensed) = (readings.pose?, readings.mission.items().items.as_ref()?);
        let position = pose.position;
        let items = sensed
            .iter()
            .map(|offset| position + ahead * offset.x + ahead.perp() * offset.y);
        let farthest = sensed.last().filter(|_| sensed.len() >= MAX_SENSED_ITEMS);
        let in_deposit = |item: Vec2| {
            let deposit = places.nearest_deposit(item);
            is_within(item - deposit, briefing.deposit_radius_m)
        };
        let waste = if is_far_from_deposit(position, sensed, briefing, places) {
            items.collect()
        } else {
            items.filter(|&item| !in_deposit(item)).collect()
        };
        Some(Self {
            position,
            ahead,
            waste,
            range: farthest.map_or(briefing.sight_m, |farthest| length(*farthest)),
        })
    }

    #[cfg(test)]
    pub fn new(position: Vec2, range: f32, waste: SensedItems) -> Self {
        Self {
            position,
            ahead: Vec2::X,
            waste,
            range,
        }
    }

    /// Returns the item seen within `slack` of a place.
    pub fn item_at(&self, place: Vec2, slack: f32) -> Option<Vec2> {
        let mut items = self.waste.iter().copied();
        items.find(|&item| is_shorter(item - place, slack))
    }

    /// Checks whether the sensor covers everything within `around` of a place.
    #[inline(always)]
    pub fn covers(&self, place: Vec2, around: f32) -> bool {
        let offset = place - self.position;
        // The first condition follows from the second, but mostly saves a square root.
        offset.abs().max_element() + around < self.range && length(offset) + around < self.range
    }

    /// Checks whether it is certain that no item lies within `slack` of a place.
    #[inline(always)]
    pub fn shows_nothing_at(&self, place: Vec2, slack: f32) -> bool {
        self.covers(place, slack) && self.item_at(place, slack).is_none()
    }
}

/// Checks whether no sensed item can lie in a deposit, because the nearest deposit is far away. Saves a query per item.
fn is_far_from_deposit(
    position: Vec2,
    sensed: &SensedItems,
    briefing: &Briefing,
    places: &KnownPlaces,
) -> bool {
    const ROUNDING_M: f32 = 0.1;
    if sensed.is_empty() {
        return true;
    }
    let deposit = places.nearest_deposit(position);
    let clear_m = length(position - deposit) - briefing.deposit_radius_m - ROUNDING_M;
    // A faulty sensor may report an offset of any length. The coordinate sum is an upper bound of the length.
    let mut offsets = sensed.iter();
    offsets.all(|offset| offset.abs().element_sum() < clear_m)
}
