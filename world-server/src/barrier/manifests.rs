//! Manifests: the broadcasts that each robot receives in a tick.

use proto::tick::ManifestEntry;
use scenario::ids::RobotId;

use super::Barrier;
use super::place::Presence;

/// The range of the robots' radios.
pub trait RadioReach {
    /// Calls `hear` once for each robot in range of the sender.
    fn for_each_receiver(&self, sender: RobotId, hear: impl FnMut(RobotId));
}

/// Sorts a manifest by (sender, tick).
pub(crate) fn sort_manifest(manifest: &mut [ManifestEntry]) {
    // The entries are already sorted, except those of a sender that answered before this robot was sent the tick.
    if !manifest.is_sorted() {
        manifest.sort_unstable();
    }
}

impl Barrier {
    /// Adds the broadcasts of all reports to the manifests of the participants in range. Leaves out robots to be killed.
    pub(super) fn list_all(&mut self, radio: &impl RadioReach) {
        for sender in 0..self.places.len() {
            let place = &mut self.places[sender];
            let Some(answer) = place.answer else {
                continue;
            };
            if std::mem::replace(&mut place.listed, true)
                || place.dies_after_tick
                || answer.broadcasts == 0
            {
                continue;
            }
            let entry = ManifestEntry {
                sender: RobotId(sender as u32),
                tick: self.tick,
                incarnation: answer.incarnation,
                count: answer.broadcasts,
                link: None,
            };
            radio.for_each_receiver(entry.sender, |hearer| {
                let place = &mut self.places[hearer.index()];
                if hearer != entry.sender && place.presence == Presence::Present && !place.lost {
                    place.manifest.push(entry.clone());
                }
            });
        }
    }
}
