//! Broadcasts between their sending and their hearing, without a bus: each is there once, for whoever is to hear it.

use std::sync::Arc;

use alliance_proto::ids::{RobotId, Tick};
use alliance_proto::team::Broadcast;
use alliance_proto::tick::ManifestEntry;
use smallvec::SmallVec;

/// The latest broadcasts of each robot.
pub(super) struct Air {
    /// By rank: of the latest tick in which it said something, and of the one before that.
    said: Vec<[Said; 2]>,
}

/// What a robot said in one tick.
#[derive(Clone, Default)]
struct Said {
    tick: Tick,
    count: usize,
    /// By index, and then some of earlier ticks, for their memory. Mostly one: it is looked up by all who hear it.
    broadcasts: SmallVec<[Arc<Broadcast>; 1]>,
}

impl Air {
    pub fn new(robots: usize) -> Self {
        Self {
            said: vec![Default::default(); robots],
        }
    }

    /// Takes what a robot says in a tick, and gives back to `spent` what nobody can hear any more. A manifest lists what was
    /// said in its tick or in the one before, and never later.
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
        let said = &mut self.said[sender.index()];
        said.rotate_right(1);
        let [latest, _] = said;
        (latest.tick, latest.count) = (tick, broadcasts.len());
        for (index, broadcast) in broadcasts.drain(..).enumerate() {
            // A receiver may keep what is on its way for long.
            match latest.broadcasts.get_mut(index) {
                Some(place) => match Arc::get_mut(place) {
                    Some(place) => spent.push(std::mem::replace(place, broadcast)),
                    None => *place = Arc::new(broadcast),
                },
                None => latest.broadcasts.push(Arc::new(broadcast)),
            }
        }
    }

    /// Writes to `collected` the broadcasts of a manifest, one place for each in its order; `None` is one that is lost, or was
    /// never sent.
    #[inline]
    pub fn collect(
        &self,
        manifest: &[ManifestEntry],
        is_lost: impl Fn(RobotId, Tick, u16) -> bool,
        collected: &mut Vec<Option<Arc<Broadcast>>>,
    ) {
        collected.clear();
        for entry in manifest {
            let mut said = self.said[entry.sender.index()].iter();
            let said = said.find(|said| said.tick == entry.tick);
            collected.extend((0..entry.count).map(|index| {
                let said = said?;
                let broadcast = said.broadcasts[..said.count].get(usize::from(index))?;
                let is_heard = broadcast.incarnation == entry.incarnation
                    && !is_lost(entry.sender, entry.tick, index);
                is_heard.then(|| Arc::clone(broadcast))
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use alliance_proto::mission::items::{ItemsBulletin, Withdrawal};
    use alliance_proto::team::Content;
    use alliance_proto::time::SimTime;

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
            body: Content::Bulletin(
                ItemsBulletin::Withdrawal(Withdrawal {
                    finder: SENDER,
                    seen: SimTime::ZERO,
                })
                .about(None),
            ),
        };
        (0..count).map(broadcast).collect()
    }

    fn heard(
        air: &Air,
        tick: Tick,
        incarnation: alliance_proto::ids::Incarnation,
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
        air.collect(&[entry], is_lost, &mut collected);
        let seq = |place: &Option<Arc<Broadcast>>| place.as_ref().map(|broadcast| broadcast.seq);
        collected.iter().map(seq).collect()
    }

    #[test]
    fn what_was_said_last_and_before_that_is_heard_but_for_what_is_lost() {
        let mut air = Air::new(2);
        let mut spent = Vec::new();
        for tick in [3, 4, 5] {
            air.send(tick, SENDER, &mut broadcasts(tick, 2), &mut spent);
            // Silence changes nothing.
            air.send(tick, SENDER, &mut Vec::new(), &mut spent);
        }
        assert_eq!(spent, broadcasts(3, 2), "nobody can hear them any more");
        assert_eq!(heard(&air, 5, 1, 2), [Some(50), None]);
        assert_eq!(heard(&air, 4, 1, 2), [Some(40), Some(41)]);
        assert_eq!(heard(&air, 4, 1, 3), [Some(40), Some(41), None]);
        assert_eq!(heard(&air, 4, 2, 1), [None], "said in another incarnation");
        assert_eq!(heard(&air, 3, 1, 1), [None], "listed too late");
    }
}
