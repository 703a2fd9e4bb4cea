//! Items that a fault has put where no robot looks.
//!
//! Robots take what lies where they look for it, and what some robot has carried before. What is strewn elsewhere is no task of
//! anybody's, unless somebody happens to come by.

use alliance_proto::mission::promises::Promises;
use alliance_proto::scenario::Scenario;

use super::{Item, WorldState, is_delivered};

/// What is known of the items so far.
#[derive(Clone, Debug, Default)]
pub struct Strewn {
    /// By id: where the item was, and whether it has not been carried since a fault put it there.
    items: Vec<(Item, bool)>,
    begun: bool,
}

impl Strewn {
    /// Looks at the items after a tick. Those of the beginning lie where robots look.
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
    pub fn is_any_off_the_ways(&self, scenario: &Scenario, promises: &Promises) -> bool {
        let mission = scenario.mission();
        self.items.iter().any(|(item, strewn)| {
            *strewn
                && !is_delivered(promises, item)
                && !mission.is_looked_for(scenario, item.position)
        })
    }
}
