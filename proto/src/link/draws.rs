//! The random draws for a message on a directed link.
//!
//! Each directed link has its own random stream ([`Purpose::Link`]). Each message uses a block of 16 words of the
//! stream, at position
//!
//! ```text
//! sent tick · 2¹⁹ + kind · 2¹⁶ + index among the sender's messages of that kind in that tick
//! ```
//!
//! The first five words are used: loss, jitter, second copy, overtaking, fading. A draw therefore depends only on the message
//! and the purpose, not on other faults, other messages or the order of arrival.

use crate::team::Broadcast;
use rand_chacha::rand_core::Rng;
use scenario::ids::RobotId;
use scenario::rng::{Purpose, link_stream};
use scenario::time::SimTime;

/// The words per block.
const WORDS: u128 = 16;

/// Returns the number of the `index`-th message of its kind in its tick, among all messages on a link.
pub(super) fn block(broadcast: &Broadcast, index: u16) -> u128 {
    let kind = broadcast.body.kind() as u16;
    u128::from(broadcast.tick) << 19 | u128::from(kind) << 16 | u128::from(index)
}

/// The draws of a message, 32 random bits each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Draws {
    pub drop: u32,
    jitter: u32,
    pub duplicate: u32,
    pub reorder: u32,
    pub fade: u32,
}

impl Draws {
    /// Creates the draws of a message on the link to `receiver`. `block` is its number on the link.
    pub fn new(seed: u64, receiver: RobotId, broadcast: &Broadcast, block: u128) -> Self {
        let mut rng = link_stream(seed, Purpose::Link, broadcast.sender, receiver);
        rng.set_word_pos(block * WORDS);
        Self {
            drop: rng.next_u32(),
            jitter: rng.next_u32(),
            duplicate: rng.next_u32(),
            reorder: rng.next_u32(),
            fade: rng.next_u32(),
        }
    }

    /// Returns a time between 0 and `jitter`, uniformly distributed over whole milliseconds.
    pub fn jitter_within(self, jitter: SimTime) -> SimTime {
        let choices = u128::from(jitter.0) + 1;
        SimTime(((choices * u128::from(self.jitter)) >> 32) as u64)
    }
}
