//! The robot's receiver. It stores broadcasts until the world's manifest lists them, and delivers them in the order
//! of the manifest.
//!
//! A broadcast that no manifest lists is never delivered.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use proto::team::{Broadcast, BroadcastId, BroadcastKey};
use proto::tick::ManifestEntry;
use scenario::ids::{RobotId, Tick};

/// The largest number of stored broadcasts, more than a correct team sends in the ticks in flight. Beyond it the
/// oldest are dropped.
const CAPACITY: usize = 65_536;

#[derive(Clone, Debug, Default)]
pub struct Radio {
    /// The broadcasts by identity; `None` for one that cannot be decoded.
    arrived: BTreeMap<BroadcastKey, Option<Broadcast>>,
    /// The oldest tick that a manifest may still list.
    oldest: Tick,
}

impl Radio {
    /// Stores a broadcast from the bus and returns true. Drops it if it is too old to be listed, or a copy.
    pub fn receive(&mut self, broadcast: Broadcast) -> bool {
        self.store(broadcast.key(), Some(broadcast))
    }

    /// Records that a broadcast has arrived that cannot be decoded. It is lost, so a step need not wait for it.
    pub fn receive_undecodable(&mut self, id: BroadcastId) -> bool {
        self.store(id.key(), None)
    }

    fn store(&mut self, key: BroadcastKey, broadcast: Option<Broadcast>) -> bool {
        if key.0 < self.oldest {
            return false;
        }
        if self.arrived.len() >= CAPACITY {
            self.arrived.pop_first();
        }
        match self.arrived.entry(key) {
            Entry::Vacant(place) => {
                place.insert(broadcast);
                true
            }
            Entry::Occupied(_) => false,
        }
    }

    /// Removes a lost broadcast (in a replay).
    pub fn lose(&mut self, sender: RobotId, tick: Tick, index: u16) {
        self.arrived
            .retain(|key, _| (key.0, key.1, key.3) != (tick, sender, index));
    }

    /// Returns whether every broadcast of the manifest has arrived.
    #[must_use]
    pub fn has_all(&self, manifest: &[ManifestEntry]) -> bool {
        manifest
            .iter()
            .all(|entry| entry.keys().all(|key| self.arrived.contains_key(&key)))
    }

    /// Replaces `collected` with the broadcasts of the manifest, in its order. A missing broadcast is `None`. Drops
    /// older broadcasts.
    pub fn collect(
        &mut self,
        manifest: &[ManifestEntry],
        collected: &mut Vec<Option<Arc<Broadcast>>>,
    ) {
        collected.clear();
        let listed = manifest.iter().flat_map(ManifestEntry::keys);
        collected.extend(listed.map(|key| self.arrived.remove(&key).flatten().map(Arc::new)));
        if let Some(oldest) = manifest.iter().map(|entry| entry.tick).min() {
            while let Some(first) = self.arrived.first_entry()
                && first.key().0 < oldest
            {
                first.remove();
            }
            self.oldest = oldest;
        }
    }
}

#[cfg(test)]
mod tests {
    use proto::allocation::{AllocationMessage, OpenMessage};
    use proto::team::BroadcastContent;
    use scenario::time::SimTime;

    use super::*;
    use crate::fixtures::{self, STEP};

    fn broadcast(sender: u32, tick: Tick, index: u16, seq: u64) -> Broadcast {
        let message = AllocationMessage::Open(OpenMessage::default());
        let body = BroadcastContent::Allocation(message);
        let sent = SimTime(tick * STEP.0);
        let broadcast = fixtures::broadcast(RobotId(sender), (1, seq), sent, body);
        Broadcast { index, ..broadcast }
    }

    fn entry(sender: u32, tick: Tick, count: u16) -> ManifestEntry {
        ManifestEntry {
            sender: RobotId(sender),
            tick,
            incarnation: 1,
            count,
            link: None,
        }
    }

    fn collect(radio: &mut Radio, manifest: &[ManifestEntry]) -> Vec<Option<u64>> {
        let mut collected = vec![None];
        radio.collect(manifest, &mut collected);
        let seq = |place: Option<Arc<Broadcast>>| Some(place?.seq);
        collected.into_iter().map(seq).collect()
    }

    #[test]
    fn broadcasts_are_delivered_in_manifest_order_for_any_arrival_order() {
        let manifest = [entry(0, 4, 2), entry(2, 4, 1)];
        let sent = [
            broadcast(2, 4, 0, 9),
            broadcast(0, 4, 1, 8),
            broadcast(0, 4, 0, 7),
        ];
        for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
            let mut radio = Radio::default();
            assert!(!radio.has_all(&manifest));
            for index in order {
                radio.receive(sent[index].clone());
            }
            assert!(radio.has_all(&manifest));
            assert_eq!(collect(&mut radio, &manifest), [Some(7), Some(8), Some(9)]);
        }
    }

    #[test]
    fn only_listed_broadcasts_are_delivered_each_once() {
        let mut radio = Radio::default();
        assert!(radio.receive(broadcast(1, 4, 0, 1)));
        assert!(!radio.receive(broadcast(1, 4, 0, 77)), "a forged copy");
        radio.receive(broadcast(1, 4, 1, 2));
        radio.receive(broadcast(1, 99, 0, 3));
        assert_eq!(collect(&mut radio, &[entry(1, 4, 1)]), [Some(1)]);
        // A missing broadcast leaves its place empty.
        radio.receive(broadcast(1, 5, 1, 8));
        assert_eq!(collect(&mut radio, &[entry(1, 5, 2)]), [None, Some(8)]);
        // Broadcasts before the manifest are dropped.
        assert!(!radio.receive(broadcast(1, 4, 2, 4)));
        assert_eq!(
            radio.arrived.len(),
            1,
            "only the broadcast of tick 99 is left"
        );
        assert!(radio.receive(broadcast(1, 5, 0, 9)));
    }

    #[test]
    fn an_undecodable_broadcast_is_lost_without_a_wait() {
        let manifest = [entry(1, 4, 2)];
        let mut radio = Radio::default();
        radio.receive(broadcast(1, 4, 1, 8));
        assert!(!radio.has_all(&manifest));
        let id = BroadcastId {
            sender: RobotId(1),
            incarnation: 1,
            tick: 4,
            index: 0,
        };
        assert!(radio.receive_undecodable(id));
        assert!(radio.has_all(&manifest));
        assert_eq!(collect(&mut radio, &manifest), [None, Some(8)]);
    }

    #[test]
    fn memory_is_bounded_under_a_flood() {
        let mut radio = Radio::default();
        for tick in 0..2 * CAPACITY as u64 {
            radio.receive(broadcast(1, tick, 0, tick));
        }
        assert_eq!(radio.arrived.len(), CAPACITY);
    }
}
