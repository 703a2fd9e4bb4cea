//! Items in places that robots reach only by a search.
//!
//! Robots take items that lie in expected places, and items that some robot has carried before. Items elsewhere require
//! a search.

use glam::Vec2;
use scenario::mission::expected_properties::ExpectedProperties;

use super::{Item, WorldState, is_delivered};

/// The state of the items between ticks.
#[derive(Clone, Debug, Default)]
pub struct Strewn {
    /// By id: the last state of the item, and `true` if it has not been carried since it was put there.
    items: Vec<(Item, bool)>,
}

impl Strewn {
    /// Updates the state after a tick.
    pub fn update(&mut self, state: &WorldState) {
        for (id, item) in state.items.iter().enumerate() {
            match self.items.get_mut(id) {
                None => self.items.push((*item, item.carrier.is_none())),
                Some((before, strewn)) => {
                    let lay = before.carrier.is_none() && item.carrier.is_none();
                    let moved = lay && before.position != item.position;
                    *strewn = item.carrier.is_none() && (*strewn || moved);
                    *before = *item;
                }
            }
        }
    }

    /// Returns the number of strewn items that robots find only by a search.
    #[must_use]
    pub fn needing_search(
        &self,
        promises: &ExpectedProperties,
        is_searched: impl Fn(Vec2) -> bool,
    ) -> usize {
        let is_off = |item: &Item| !is_delivered(promises, item) && !is_searched(item.position);
        let strewn = self.items.iter().filter(|(_, strewn)| *strewn);
        strewn.filter(|(item, _)| is_off(item)).count()
    }
}
