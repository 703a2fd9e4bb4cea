//! What a robot hears: the broadcasts that the world's manifest lists, in an order that does not depend on how they came.
//!
//! Anything that no manifest lists is never heard (DESIGN §4), whatever somebody puts on the bus.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::team::{Body, Broadcast};
use alliance_proto::telemetry::{Fate, Reception, Said};
use alliance_proto::tick::ManifestEntry;
use alliance_proto::time::SimTime;

/// Broadcasts that have arrived and wait for the manifest that lists them. More than any honest team sends in the ticks
/// that can be under way; what exceeds it is the oldest, or junk.
const CAPACITY: usize = 65_536;

/// Identity of a broadcast.
type Key = (Tick, RobotId, Incarnation, u16);

/// What one step's listening gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// Audible broadcasts, by (sender rank, sequence number).
    pub inbox: Vec<Broadcast>,
    /// The fate of each broadcast that was listed.
    pub receptions: Vec<Reception>,
}

/// The robot's receiver.
#[derive(Clone, Debug, Default)]
pub struct Radio {
    arrived: BTreeMap<Key, Broadcast>,
    /// Broadcasts of earlier ticks are listed no more.
    oldest: Tick,
}

impl Radio {
    /// Takes a broadcast from the bus, unless it is too old ever to be listed or is there already: a replayed one changes
    /// nothing. Says whether it was taken.
    pub fn receive(&mut self, broadcast: Broadcast) -> bool {
        if broadcast.tick < self.oldest {
            return false;
        }
        if self.arrived.len() >= CAPACITY {
            self.arrived.pop_first();
        }
        let key = (
            broadcast.tick,
            broadcast.sender,
            broadcast.incarnation,
            broadcast.index,
        );
        match self.arrived.entry(key) {
            Entry::Vacant(place) => {
                place.insert(broadcast);
                true
            }
            Entry::Occupied(_) => false,
        }
    }

    /// In a replay: forgets a broadcast that got lost.
    pub fn lose(&mut self, sender: RobotId, tick: Tick, index: u16) {
        self.arrived
            .retain(|key, _| (key.0, key.1, key.3) != (tick, sender, index));
    }

    /// Whether every broadcast of the manifest has arrived.
    #[must_use]
    pub fn has_all(&self, manifest: &[ManifestEntry]) -> bool {
        manifest
            .iter()
            .all(|entry| keys(entry).all(|key| self.arrived.contains_key(&key)))
    }

    /// Hears the broadcasts of the manifest at `now`; those that have not arrived are lost. Older ones are forgotten.
    pub fn listen(&mut self, manifest: &[ManifestEntry], now: SimTime, step: SimTime) -> Heard {
        let mut heard = Heard::default();
        for entry in manifest {
            for key in keys(entry) {
                let broadcast = self.arrived.remove(&key);
                heard.receptions.push(Reception {
                    at: now,
                    sender: entry.sender,
                    incarnation: entry.incarnation,
                    sent: SimTime(entry.tick.saturating_mul(step.0)),
                    fate: if broadcast.is_some() {
                        Fate::Heard
                    } else {
                        Fate::Lost
                    },
                    said: broadcast.as_ref().map(said),
                });
                heard.inbox.extend(broadcast);
            }
        }
        heard.inbox.sort_by_key(|broadcast| {
            (
                broadcast.sender,
                broadcast.incarnation,
                broadcast.seq,
                broadcast.index,
            )
        });
        if let Some(oldest) = manifest.iter().map(|entry| entry.tick).min() {
            self.arrived = self.arrived.split_off(&(oldest, RobotId(0), 0, 0));
            self.oldest = oldest;
        }
        heard
    }
}

fn keys(entry: &ManifestEntry) -> impl Iterator<Item = Key> {
    let (tick, sender, incarnation) = (entry.tick, entry.sender, entry.incarnation);
    (0..entry.count).map(move |index| (tick, sender, incarnation, index))
}

/// The part of a broadcast that goes into the log.
fn said(broadcast: &Broadcast) -> Said {
    let (state, since, set, task, progress) = match &broadcast.body {
        Body::Heartbeat(heartbeat) => (
            Some(heartbeat.state),
            Some(heartbeat.since),
            heartbeat.set,
            heartbeat.task,
            Some(heartbeat.progress),
        ),
        Body::PositionUpdate {
            task,
            set,
            progress,
            ..
        } => (None, None, Some(*set), Some(*task), Some(*progress)),
        Body::Withdrawal(_) => (None, None, None, None, None),
    };
    Said {
        seq: broadcast.seq,
        kind: broadcast.body.kind(),
        state,
        since,
        set,
        task,
        progress,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alliance_proto::team::Withdrawal;

    fn broadcast(sender: u16, tick: Tick, index: u16, seq: u64) -> Broadcast {
        Broadcast {
            sender: RobotId(sender),
            incarnation: 1,
            tick,
            index,
            seq,
            sent: SimTime(tick * 50),
            body: Body::Withdrawal(Withdrawal {
                finder: RobotId(sender),
                seen: SimTime(seq),
            }),
        }
    }

    fn entry(sender: u16, tick: Tick, count: u16) -> ManifestEntry {
        ManifestEntry {
            sender: RobotId(sender),
            tick,
            incarnation: 1,
            count,
            link: None,
        }
    }

    #[test]
    fn hears_what_is_listed_in_rank_order_whatever_the_order_of_arrival() {
        let manifest = [entry(0, 4, 2), entry(2, 4, 1)];
        let sent = [
            broadcast(2, 4, 0, 9),
            broadcast(0, 4, 1, 8),
            broadcast(0, 4, 0, 7),
        ];
        let mut orders = vec![vec![0, 1, 2], vec![2, 1, 0], vec![1, 0, 2]];
        let mut results = Vec::new();
        for order in orders.drain(..) {
            let mut radio = Radio::default();
            assert!(!radio.has_all(&manifest));
            for index in order {
                radio.receive(sent[index].clone());
            }
            assert!(radio.has_all(&manifest));
            results.push(radio.listen(&manifest, SimTime(250), SimTime(50)));
        }
        assert_eq!(
            results[0].inbox.iter().map(|b| b.seq).collect::<Vec<_>>(),
            [7, 8, 9]
        );
        assert!(results.iter().all(|result| *result == results[0]));
    }

    #[test]
    fn what_no_manifest_lists_is_never_heard() {
        let mut radio = Radio::default();
        radio.receive(broadcast(1, 4, 0, 1));
        radio.receive(broadcast(1, 4, 1, 2));
        radio.receive(broadcast(1, 99, 0, 3));
        let heard = radio.listen(&[entry(1, 4, 1)], SimTime(250), SimTime(50));
        assert_eq!(heard.inbox.iter().map(|b| b.seq).collect::<Vec<_>>(), [1]);
        assert_eq!(heard.receptions.len(), 1);
    }

    #[test]
    fn a_listed_broadcast_that_never_came_is_lost_and_logged_with_its_sender() {
        let mut radio = Radio::default();
        let heard = radio.listen(&[entry(1, 4, 1)], SimTime(250), SimTime(50));
        assert!(heard.inbox.is_empty());
        assert_eq!(heard.receptions[0].fate, Fate::Lost);
        assert_eq!(heard.receptions[0].sender, RobotId(1));
        assert_eq!(heard.receptions[0].sent, SimTime(200));
        assert_eq!(heard.receptions[0].said, None);
    }

    #[test]
    fn a_replayed_or_forged_second_copy_changes_nothing() {
        let mut radio = Radio::default();
        assert!(radio.receive(broadcast(1, 4, 0, 1)));
        assert!(!radio.receive(broadcast(1, 4, 0, 77)));
        let heard = radio.listen(&[entry(1, 4, 1)], SimTime(250), SimTime(50));
        assert_eq!(heard.inbox[0].seq, 1);
    }

    #[test]
    fn what_is_older_than_all_that_may_be_listed_is_not_kept() {
        let mut radio = Radio::default();
        radio.listen(&[entry(1, 4, 0)], SimTime(250), SimTime(50));
        assert!(!radio.receive(broadcast(1, 3, 0, 1)));
        assert!(radio.arrived.is_empty());
        assert!(radio.receive(broadcast(1, 4, 0, 2)));
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
