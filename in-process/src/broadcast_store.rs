//! Delivery of broadcasts without a bus. Each broadcast is stored once for all receivers.

use std::sync::Arc;

use prefetch::prefetch;
use proto::team::Broadcast;
use proto::tick::ManifestEntry;
use scenario::ids::{RobotId, Tick};
use smallvec::SmallVec;

#[derive(Clone)]
pub(super) struct BroadcastStore {
    /// By rank: the broadcasts of the two latest ticks in which the robot sent any.
    sent: Vec<[SentBroadcasts; 2]>,
}

#[derive(Clone, Default)]
struct SentBroadcasts {
    tick: Tick,
    count: usize,
    /// Broadcasts by index, followed by unused ones of earlier ticks, whose memory is reused. Inline for one, the most frequent number.
    broadcasts: SmallVec<[Arc<Broadcast>; 1]>,
}

impl BroadcastStore {
    pub fn new(robots: usize) -> Self {
        Self {
            sent: vec![Default::default(); robots],
        }
    }

    /// Requests the memory of the list of robots, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self) {
        prefetch(&*self.sent);
    }

    /// Stores a robot's broadcasts of a tick and moves those that can no longer be received to `spent`. A manifest lists broadcasts of
    /// its own tick or the previous one only.
    #[inline]
    pub fn send(
        &mut self,
        tick: Tick,
        sender: RobotId,
        broadcasts: &mut Vec<Broadcast>,
        spent: &mut Vec<Broadcast>,
    ) {
        if broadcasts.is_empty() {
            return;
        }
        let sent = &mut self.sent[sender.index()];
        sent.rotate_right(1);
        let [latest, _] = sent;
        (latest.tick, latest.count) = (tick, broadcasts.len());
        for (index, broadcast) in broadcasts.drain(..).enumerate() {
            // A receiver may hold a message in flight for a long time.
            match latest.broadcasts.get_mut(index) {
                Some(slot) => match Arc::get_mut(slot) {
                    Some(slot) => spent.push(std::mem::replace(slot, broadcast)),
                    None => *slot = Arc::new(broadcast),
                },
                None => latest.broadcasts.push(Arc::new(broadcast)),
            }
        }
    }

    /// Returns all broadcasts that a manifest can still list.
    pub fn recent(&self) -> impl Iterator<Item = &Broadcast> {
        self.sent.iter().flatten().flat_map(|sent| {
            let broadcasts = sent.broadcasts[..sent.count].iter();
            broadcasts.map(|broadcast| &**broadcast)
        })
    }

    /// Writes the broadcasts of a manifest to `collected`, one entry for each in order. `None` stands for a lost or unsent one.
    #[inline]
    pub fn collect(
        &self,
        manifest: &[ManifestEntry],
        is_lost: impl Fn(RobotId, Tick, u16) -> bool,
        collected: &mut Vec<Option<Arc<Broadcast>>>,
    ) {
        collected.clear();
        for entry in manifest {
            let mut sent = self.sent[entry.sender.index()].iter();
            let sent = sent.find(|sent| sent.tick == entry.tick);
            collected.extend((0..entry.count).map(|index| {
                let sent = sent?;
                let broadcast = sent.broadcasts[..sent.count].get(usize::from(index))?;
                let is_received = broadcast.incarnation == entry.incarnation
                    && !is_lost(entry.sender, entry.tick, index);
                is_received.then(|| Arc::clone(broadcast))
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use proto::mission::items::{ItemsBulletin, Withdrawal};
    use proto::team::BroadcastContent;
    use scenario::time::SimTime;

    use super::*;

    const SENDER: RobotId = RobotId(1);

    fn broadcasts(tick: Tick, count: u16) -> Vec<Broadcast> {
        let broadcast = |index| Broadcast {
            sender: SENDER,
            incarnation: 1,
            tick,
            index,
            seq: 10 * tick + u64::from(index),
            sent: SimTime(tick),
            body: BroadcastContent::Bulletin(
                ItemsBulletin::Withdrawal(Withdrawal {
                    finder: SENDER,
                    seen: SimTime::ZERO,
                })
                .into_bulletin(None),
            ),
        };
        (0..count).map(broadcast).collect()
    }

    fn received(
        store: &BroadcastStore,
        tick: Tick,
        incarnation: scenario::ids::Incarnation,
        count: u16,
    ) -> Vec<Option<u64>> {
        let entry = ManifestEntry {
            sender: SENDER,
            tick,
            incarnation,
            count,
            link: None,
        };
        let mut collected = Vec::new();
        let is_lost = |_, tick, index| (tick, index) == (5, 1);
        store.collect(&[entry], is_lost, &mut collected);
        let seq = |entry: &Option<Arc<Broadcast>>| entry.as_ref().map(|broadcast| broadcast.seq);
        collected.iter().map(seq).collect()
    }

    #[test]
    fn broadcasts_of_the_two_latest_ticks_are_received_unless_lost() {
        let mut store = BroadcastStore::new(2);
        let mut spent = Vec::new();
        for tick in [3, 4, 5] {
            store.send(tick, SENDER, &mut broadcasts(tick, 2), &mut spent);
            // A tick without broadcasts changes nothing.
            store.send(tick, SENDER, &mut Vec::new(), &mut spent);
        }
        assert_eq!(spent, broadcasts(3, 2), "they can no longer be received");
        assert_eq!(received(&store, 5, 1, 2), [Some(50), None]);
        assert_eq!(received(&store, 4, 1, 2), [Some(40), Some(41)]);
        assert_eq!(received(&store, 4, 1, 3), [Some(40), Some(41), None]);
        assert_eq!(
            received(&store, 4, 2, 1),
            [None],
            "sent in another incarnation"
        );
        assert_eq!(received(&store, 3, 1, 1), [None], "listed too late");
    }
}
