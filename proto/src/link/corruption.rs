//! Bit errors: each bit of a message's payload flips with the same probability, independently of the others.
//!
//! The payload is the encoded [`BroadcastContent`]. The header, which identifies the message in manifests, stays intact.
//! The flips are a function of seed, link and message. One word of the link's stream of [`Purpose::Corruption`] gives the
//! number of intact bits before the next flip, which has a geometric distribution. The words start at the position
//!
//! ```text
//! (sent tick · 2¹⁹ + kind · 2¹⁶ + index) · 2²¹
//! ```
//!
//! The bits of a byte follow each other from the lowest. A block of 2²¹ words has room for a flip of each bit of the
//! longest message.
//! Bits are flipped after the seal was checked, as by a radio whose frames reach the program.

use std::sync::Arc;

use rand_chacha::rand_core::Rng;
use scenario::ids::RobotId;
use scenario::rng::{Purpose, link_stream};

use super::Probability;
use crate::codec::{decode, encode};
use crate::team::{Broadcast, BroadcastContent};

/// The words of the stream per message.
const WORDS: u128 = 1 << 21;

/// A message after its way over a link with bit errors.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Arrival {
    /// No bit has flipped.
    Intact,
    /// A bit has flipped, and the payload can still be decoded.
    Damaged(Arc<Broadcast>),
    /// A bit has flipped, and the payload cannot be decoded.
    Undecodable,
}

/// Returns a message with the flips of the link to `receiver`. `block` is the message's number on the link.
pub(super) fn transmit(
    seed: u64,
    receiver: RobotId,
    broadcast: &Broadcast,
    block: u128,
    flip: Probability,
) -> Arrival {
    // A message that is too large to encode has not been sent.
    let Ok(mut payload) = encode(&broadcast.body) else {
        return Arrival::Undecodable;
    };
    let mut rng = link_stream(seed, Purpose::Corruption, broadcast.sender, receiver);
    rng.set_word_pos(block * WORDS);
    if flip_bits(&mut payload, flip, &mut rng) == 0 {
        return Arrival::Intact;
    }
    match decode::<BroadcastContent>(&payload) {
        Ok(body) => Arrival::Damaged(Arc::new(Broadcast {
            body,
            ..broadcast.clone()
        })),
        Err(_) => Arrival::Undecodable,
    }
}

/// Flips each bit with the probability `flip` and returns the number of flips.
fn flip_bits(payload: &mut [u8], flip: Probability, rng: &mut impl Rng) -> u32 {
    if flip == Probability::NEVER {
        return 0;
    }
    let gaps = Gaps::new(flip);
    let bits = 8 * payload.len();
    let (mut flips, mut bit) = (0, 0);
    while bit < bits {
        bit += gaps.length(rng.next_u32());
        if let Some(byte) = payload.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
            flips += 1;
        }
        bit += 1;
    }
    flips
}

/// The lengths of the runs of intact bits between flips, with a geometric distribution: n or more bits stay intact with
/// the probability (1 - p)ⁿ. Integers give the same lengths on every machine and in every language.
struct Gaps {
    /// (1 - p) to the power of 2⁰, 2¹, 2² and so on, in units of 2⁻⁶⁴, rounded down.
    powers: [u64; LEVELS],
}

/// The number of binary digits of a length. The longest length is more than the bits of the longest message.
const LEVELS: usize = 22;

impl Gaps {
    /// Creates the lengths for a probability above 0.
    fn new(flip: Probability) -> Self {
        let mut powers = [((1 << 32) - flip.0) << 32; LEVELS];
        for level in 1..LEVELS {
            powers[level] = product(powers[level - 1].into(), powers[level - 1]) as u64;
        }
        Self { powers }
    }

    /// Returns the length for a draw of 32 random bits: the largest n whose probability (1 - p)ⁿ exceeds the draw. Its
    /// digits are determined from the highest.
    fn length(&self, draw: u32) -> usize {
        let draw = u128::from(draw) << 32;
        let (mut length, mut probability) = (0, 1 << 64);
        for level in (0..LEVELS).rev() {
            let longer = product(probability, self.powers[level]);
            if draw < longer {
                (length, probability) = (length + (1 << level), longer);
            }
        }
        length
    }
}

/// Returns the product of two probabilities in units of 2⁻⁶⁴, rounded down.
fn product(one: u128, other: u64) -> u128 {
    (one * u128::from(other)) >> 64
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;

    /// The number of standard deviations that a count may differ from its mean. For a normal distribution, one count in
    /// 15,000 differs by more.
    const DEVIATIONS: f64 = 4.0;

    #[test]
    fn flips_and_damaged_messages_match_the_closed_forms() {
        const MESSAGES: u32 = 20_000;
        for (p, bytes) in [(0.001, 20), (0.000_1, 200), (0.02, 3), (0.5, 1)] {
            let bits = 8.0 * bytes as f64;
            let mut rng = ChaCha8Rng::seed_from_u64(bytes);
            let (mut flips, mut damaged) = (0, 0);
            for _ in 0..MESSAGES {
                let mut payload = vec![0; bytes as usize];
                let flipped = flip_bits(&mut payload, Probability::from_share(p), &mut rng);
                let ones: u32 = payload.iter().map(|byte| byte.count_ones()).sum();
                assert_eq!(ones, flipped);
                flips += flipped;
                damaged += u32::from(flipped > 0);
            }
            // Binomial distributions: the bits of all messages, and the messages with 1 − (1 − p)^n.
            let messages = f64::from(MESSAGES);
            for (count, trials, share) in [
                (flips, messages * bits, p),
                (damaged, messages, 1.0 - (1.0 - p).powf(bits)),
            ] {
                let (mean, variance) = (trials * share, trials * share * (1.0 - share));
                let off = (f64::from(count) - mean).abs() / variance.sqrt();
                assert!(off < DEVIATIONS, "p {p}, {bytes} bytes: {count} and {mean}");
            }
        }
    }

    #[test]
    fn probabilities_0_and_1_are_exact() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut payload = [0b1010_0000, 7];
        assert_eq!(flip_bits(&mut payload, Probability::NEVER, &mut rng), 0);
        assert_eq!(payload, [0b1010_0000, 7]);
        assert_eq!(flip_bits(&mut payload, Probability::ALWAYS, &mut rng), 16);
        assert_eq!(payload, [0b0101_1111, 0xf8]);
    }
}
