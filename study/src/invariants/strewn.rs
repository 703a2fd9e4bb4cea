//! Items that a fault has put where no robot looks.
//!
//! move-spill takes what lies in a spill or is seen on the way between it and the deposit, and what some robot has carried
//! before. Waste that is strewn elsewhere is no task of anybody's, unless somebody happens to come by.

use alliance_proto::scenario::Scenario;
use glam::Vec2;
use missions::waste::data::WasteSection;

use super::{Item, WorldState};

/// What is known of the items so far.
#[derive(Clone, Debug, Default)]
pub struct Strewn {
    /// By id: where the item was, and whether it has not been carried since a fault put it there.
    items: Vec<(Item, bool)>,
    begun: bool,
}

impl Strewn {
    /// Looks at the items after a tick. Those of the beginning lie in their spills.
    pub fn note(&mut self, state: &WorldState) {
        for (id, item) in state.items.iter().enumerate() {
            match self.items.get_mut(id) {
                None => self.items.push((*item, self.begun)),
                Some((before, strewn)) => {
                    let lay = before.carrier.is_none() && item.carrier.is_none();
                    let moved = lay && before.position != item.position;
                    *strewn = item.carrier.is_none() && (*strewn || moved);
                    *before = *item;
                }
            }
        }
        self.begun = true;
    }

    /// Whether one of them lies where nobody looks.
    #[must_use]
    pub fn is_any_off_the_ways(&self, scenario: &Scenario, state: &WorldState) -> bool {
        self.items.iter().any(|(item, strewn)| {
            *strewn
                && !state.is_delivered(scenario, item)
                && !is_looked_for(scenario, item.position)
        })
    }
}

/// Whether a place is in a spill, or beside the straight way from one to the deposit, where it is seen also by a robot that
/// goes round something.
fn is_looked_for(scenario: &Scenario, place: Vec2) -> bool {
    let waste = WasteSection::of(scenario);
    waste.spills.iter().any(|spill| {
        let spill = spill.spot().in_room(&scenario.room);
        let deposits = waste
            .deposits()
            .map(|deposit| deposit.in_room(&scenario.room));
        let ways = deposits.map(|deposit| deposit - spill);
        let way = ways
            .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .unwrap_or_default();
        let share = (place - spill).dot(way) / way.length_squared().max(f32::MIN_POSITIVE);
        let nearest = spill + way * share.clamp(0.0, 1.0);
        place.distance(spill) <= waste.spill_radius_m
            || place.distance(nearest) <= scenario.sensors.item_range_m / 2.0
    })
}
