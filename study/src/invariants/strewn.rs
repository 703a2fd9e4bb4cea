//! Items that lie where robots come only when they know of nothing else.
//!
//! Robots take what lies where they look for it, and what some robot has carried before. What is strewn elsewhere they have to
//! search for.

use alliance_proto::mission::promises::Promises;
use alliance_proto::scenario::Scenario;

use super::{Item, WorldState, is_delivered};

/// What is known of the items so far.
#[derive(Clone, Debug, Default)]
pub struct Strewn {
    /// By id: where the item was, and whether it has not been carried since it was put there.
    items: Vec<(Item, bool)>,
}

impl Strewn {
    /// Looks at the items after a tick.
    pub fn note(&mut self, state: &WorldState) {
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

    /// How many of them lie where nobody looks who does not search.
    #[must_use]
    pub fn off_the_ways(&self, scenario: &Scenario, promises: &Promises) -> usize {
        let mission = scenario.mission();
        let is_off = |item: &Item| {
            !is_delivered(promises, item) && !mission.is_looked_for(scenario, item.position)
        };
        let strewn = self.items.iter().filter(|(_, strewn)| *strewn);
        strewn.filter(|(item, _)| is_off(item)).count()
    }
}
