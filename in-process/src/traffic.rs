//! Counts of a team's broadcasts by kind.

use proto::team::{Broadcast, BroadcastKind};
use robot_agent::agent::payload_bytes;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BroadcastCount {
    /// The number of broadcasts, each counted once for all receivers.
    pub messages: u64,
    /// The total size of the encoded and sealed payloads in bytes.
    pub bytes: u64,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BroadcastCounts([BroadcastCount; BroadcastKind::ALL.len()]);

impl BroadcastCounts {
    pub(super) fn add(&mut self, broadcasts: &[Broadcast]) {
        for broadcast in broadcasts {
            let counts = &mut self.0[broadcast.body.kind() as usize];
            counts.messages += 1;
            counts.bytes += u64::from(payload_bytes(broadcast));
        }
    }

    pub fn by_kind(&self) -> impl Iterator<Item = (BroadcastKind, BroadcastCount)> + '_ {
        BroadcastKind::ALL.into_iter().zip(self.0.iter().copied())
    }
}
