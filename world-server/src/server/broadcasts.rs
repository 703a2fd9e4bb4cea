//! The broadcasts that have reached the world. Each tick message contains those that its manifest lists.

use std::collections::BTreeMap;
use std::sync::Arc;

use proto::codec::{CodecError, LIMIT_BYTES};
use proto::team::{Broadcast, BroadcastKey, EncodedBroadcast};
use proto::tick::{ManifestEntry, Report, TICK_LIMIT_BYTES};

/// The total size of the broadcasts in a tick message, bytes. The rest of it is as large as any other message.
const BROADCASTS_BYTES: usize = TICK_LIMIT_BYTES - LIMIT_BYTES;

#[derive(Default)]
pub(super) struct Broadcasts(BTreeMap<BroadcastKey, StoredBroadcast>);

struct StoredBroadcast {
    broadcast: Arc<Broadcast>,
    encoded: EncodedBroadcast,
}

impl Broadcasts {
    /// Stores a broadcast. The first of several with the same identity counts. Drops those that no manifest can list any
    /// more: manifests list broadcasts of the current and the previous tick.
    ///
    /// # Errors
    /// Returns [`CodecError::TooLarge`] above the size limit of a message.
    pub fn store(&mut self, broadcast: Broadcast) -> Result<(), CodecError> {
        let encoded = EncodedBroadcast::of(&broadcast)?;
        while let Some(first) = self.0.first_entry()
            && first.key().0 + 1 < broadcast.tick
        {
            first.remove();
        }
        self.0
            .entry(broadcast.key())
            .or_insert_with(|| StoredBroadcast {
                broadcast: Arc::new(broadcast),
                encoded,
            });
        Ok(())
    }

    /// Returns the number of broadcasts of a report that are stored, before the first gap.
    #[must_use]
    pub fn arrived(&self, report: &Report) -> u16 {
        let listed = ManifestEntry {
            sender: report.robot,
            tick: report.tick,
            incarnation: report.incarnation,
            count: report.broadcasts,
            link: None,
        };
        let is_stored = |key: &BroadcastKey| self.0.contains_key(key);
        listed.keys().take_while(is_stored).count() as u16
    }

    /// Returns the broadcasts of a manifest, in its order; `None` for one that has not arrived, or for which the message has no
    /// room.
    pub fn listed(
        &self,
        manifest: &[ManifestEntry],
    ) -> impl Iterator<Item = Option<&Arc<Broadcast>>> {
        self.stored(manifest).map(|stored| Some(&stored?.broadcast))
    }

    /// Returns the encodings of [`Broadcasts::listed`].
    pub fn encoded(&self, manifest: &[ManifestEntry]) -> Vec<Option<&EncodedBroadcast>> {
        let stored = self.stored(manifest);
        stored.map(|stored| Some(&stored?.encoded)).collect()
    }

    fn stored(&self, manifest: &[ManifestEntry]) -> impl Iterator<Item = Option<&StoredBroadcast>> {
        let keys = manifest.iter().flat_map(ManifestEntry::keys);
        let mut room = BROADCASTS_BYTES;
        keys.map(move |key| {
            let stored = self.0.get(&key)?;
            room = room.checked_sub(stored.encoded.size())?;
            Some(stored)
        })
    }
}

#[cfg(test)]
mod tests {
    use proto::allocation::{AllocationMessage, OpenMessage};
    use proto::team::BroadcastContent;
    use scenario::ids::{RobotId, Tick};
    use scenario::time::SimTime;

    use super::*;

    const SENDER: RobotId = RobotId(1);

    fn broadcast(tick: Tick, index: u16, seq: u64) -> Broadcast {
        Broadcast {
            sender: SENDER,
            incarnation: 1,
            tick,
            index,
            seq,
            sent: SimTime(50 * tick),
            body: BroadcastContent::Allocation(AllocationMessage::Open(OpenMessage::default())),
        }
    }

    fn arrived(broadcasts: &Broadcasts, tick: Tick, count: u16) -> u16 {
        broadcasts.arrived(&Report {
            robot: SENDER,
            incarnation: 1,
            tick,
            broadcasts: count,
            ..Report::default()
        })
    }

    /// Returns the numbers of a manifest's broadcasts, which the receiver decodes.
    fn received(broadcasts: &Broadcasts, tick: Tick, count: u16) -> Vec<Option<u64>> {
        let manifest = [ManifestEntry {
            sender: SENDER,
            tick,
            incarnation: 1,
            count,
            link: None,
        }];
        let encoded = broadcasts.encoded(&manifest);
        let decoded = encoded
            .into_iter()
            .map(|encoded| Some(encoded?.decode().unwrap().seq));
        let decoded = Vec::from_iter(decoded);
        let listed = broadcasts.listed(&manifest).map(|listed| Some(listed?.seq));
        assert_eq!(decoded, Vec::from_iter(listed));
        decoded
    }

    #[test]
    fn listed_broadcasts_are_passed_on_in_order_and_the_first_of_two_counts() {
        let mut broadcasts = Broadcasts::default();
        for (index, seq) in [(1, 8), (0, 7), (1, 99), (3, 9)] {
            broadcasts.store(broadcast(4, index, seq)).unwrap();
        }
        assert_eq!(received(&broadcasts, 4, 2), [Some(7), Some(8)]);
        assert_eq!(
            received(&broadcasts, 4, 4),
            [Some(7), Some(8), None, Some(9)]
        );
        assert_eq!(
            [1, 2, 3, 4].map(|count| arrived(&broadcasts, 4, count)),
            [1, 2, 2, 2]
        );
        assert_eq!(arrived(&broadcasts, 5, 1), 0, "of another tick");
    }

    #[test]
    fn broadcasts_beyond_the_size_of_a_message_are_left_out() {
        let mut broadcasts = Broadcasts::default();
        for index in 0..1000 {
            let message = OpenMessage {
                schema: String::new(),
                bytes: vec![7; 1_190],
            };
            broadcasts
                .store(Broadcast {
                    body: BroadcastContent::Allocation(AllocationMessage::Open(message)),
                    ..broadcast(4, index, index.into())
                })
                .unwrap();
        }
        let received = received(&broadcasts, 4, 1000);
        let (first, rest) = received.split_at(600);
        assert!(first.iter().all(Option::is_some));
        assert!(rest[20..].iter().all(Option::is_none));
    }

    #[test]
    fn only_the_broadcasts_of_two_ticks_are_stored() {
        let mut broadcasts = Broadcasts::default();
        for tick in 1..1000 {
            broadcasts.store(broadcast(tick, 0, tick)).unwrap();
            assert!(broadcasts.0.len() <= 2);
        }
        assert_eq!(received(&broadcasts, 998, 1), [Some(998)]);
        assert_eq!(received(&broadcasts, 997, 1), [None]);
    }
}
