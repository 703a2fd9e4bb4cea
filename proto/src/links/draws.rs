//! What chance has in store for a message on a directed link.
//!
//! Each directed link has a stream of its own ([`Purpose::Link`]), and each message a block of 16 words in it, the block
//!
//! ```text
//! tick in which it was sent · 2¹⁹ + kind · 2¹⁶ + index among its sender's messages of that kind in that tick
//! ```
//!
//! of which the first four are used: loss, jitter, second copy, overtaking. So a draw depends on nothing but the message and
//! its purpose: not on other faults, other messages or the order of arrival (DESIGN §5).

use crate::ids::RobotId;
use crate::rng::{Purpose, link_stream};
use crate::team::Broadcast;
use crate::time::SimTime;
use rand_chacha::rand_core::Rng;

/// Words of a message's block.
const WORDS: u128 = 16;

/// A message's draws, 32 random bits each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Draws {
    pub drop: u32,
    jitter: u32,
    pub duplicate: u32,
    pub reorder: u32,
}

impl Draws {
    /// Of a message to `receiver`, the `index`-th of its kind in its tick.
    pub fn of(seed: u64, receiver: RobotId, broadcast: &Broadcast, index: u16) -> Self {
        let mut rng = link_stream(seed, Purpose::Link, broadcast.sender, receiver);
        let kind = broadcast.body.kind() as u16;
        let block = u128::from(broadcast.tick) << 19 | u128::from(kind) << 16 | u128::from(index);
        rng.set_word_pos(block * WORDS);
        Self {
            drop: rng.next_u32(),
            jitter: rng.next_u32(),
            duplicate: rng.next_u32(),
            reorder: rng.next_u32(),
        }
    }

    /// A part of that jitter, from 0 to all of it, each whole number of ms as likely as any other.
    pub fn share_of(self, jitter: SimTime) -> SimTime {
        let choices = u128::from(jitter.0) + 1;
        SimTime(((choices * u128::from(self.jitter)) >> 32) as u64)
    }
}
