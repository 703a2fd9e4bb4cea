//! What a team has said, by kind of broadcast.

use alliance_proto::team::{Broadcast, BroadcastKind};
use robot_agent::agent::payload_bytes;

/// Broadcasts of a kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Said {
    /// Each counts once, however many hear it.
    pub messages: u64,
    /// Their payloads: encoded and sealed.
    pub bytes: u64,
}

/// All that was said so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Traffic([Said; BroadcastKind::ALL.len()]);

impl Traffic {
    /// Adds what a robot says in a tick.
    pub(super) fn add(&mut self, broadcasts: &[Broadcast]) {
        for broadcast in broadcasts {
            let said = &mut self.0[broadcast.body.kind() as usize];
            said.messages += 1;
            said.bytes += u64::from(payload_bytes(broadcast));
        }
    }

    /// What was said of each kind.
    pub fn by_kind(&self) -> impl Iterator<Item = (BroadcastKind, Said)> + '_ {
        BroadcastKind::ALL.into_iter().zip(self.0.iter().copied())
    }
}
