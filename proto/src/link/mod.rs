//! Radio links: their state in a tick, its effects on messages, and the deliveries that result.
//!
//! The world sends the state of each link to the receiver, whose radio applies it to the messages ([`IncomingMessages`]). The
//! receiver reports the [`Delivery`], and [`LinkState::effect_behind`] returns the effect of the state that decided it.
//! [`IncomingMessages`] holds the messages in flight to one robot and no faults: the bytes of reports are part of the
//! hash, so a reported delivery cannot name its cause, and the world, which holds the faults, looks it up.

mod corruption;
mod draws;
mod incoming;

use serde::{Deserialize, Serialize};

use crate::telemetry::Delivery;
use scenario::time::SimTime;

pub use incoming::{IncomingMessages, StepMessages};

/// A probability in units of 2⁻³². Integer arithmetic makes a draw of 32 bits give the same result on every machine.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Probability(u64);

impl Probability {
    pub const NEVER: Self = Self(0);
    pub const ALWAYS: Self = Self(1 << 32);

    /// Creates the nearest probability. Values outside 0 to 1 are clamped, and NaN counts as 0.
    #[must_use]
    pub fn from_share(share: f64) -> Self {
        Self((share.clamp(0.0, 1.0) * (1_u64 << 32) as f64).round() as u64)
    }

    /// Returns whether a draw of 32 random bits is a hit.
    #[must_use]
    pub fn hits(self, draw: u32) -> bool {
        u64::from(draw) < self.0
    }

    /// Returns the probability that at least one of two independent events happens.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        // Each factor is at most 2³², so their product needs at most 65 bits.
        let neither = u128::from((1 << 32) - self.0) * u128::from((1 << 32) - other.0);
        Self((1 << 32) - (neither >> 32) as u64)
    }

    /// Returns the probability that exactly one of two independent events happens.
    #[must_use]
    pub fn xor(self, other: Self) -> Self {
        let only = |one: Self, not: Self| u128::from(one.0) * u128::from((1 << 32) - not.0);
        Self(((only(self, other) + only(other, self)) >> 32) as u64)
    }
}

/// The effect of faults and of the radio channel on the messages of one sender at one receiver in one tick. The default is
/// an undisturbed link.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct LinkState {
    /// `true` if all messages are lost because of mute, deaf, partition or range.
    pub cut: bool,
    /// `true` if messages are held back while [`crate::tick::TickMessage::held`] lists the sender.
    pub hold: bool,
    /// The loss probability of each message.
    pub drop: Probability,
    pub delay: SimTime,
    /// The largest additional random delay.
    pub jitter: SimTime,
    /// The probability of a second copy.
    pub duplicate: Probability,
    /// The probability that the next message of the same sender overtakes a message.
    pub reorder: Probability,
    /// `true` if an obstacle blocks all messages.
    pub blocked: bool,
    /// The probability that a message is lost by fading.
    pub fade: Probability,
    /// The probability that a bit of a payload flips.
    pub corrupt: Probability,
    /// `true` if damaged messages are dropped. Otherwise those that can be decoded are delivered.
    pub checksum: bool,
}

impl LinkState {
    #[must_use]
    pub fn is_clear(&self) -> bool {
        *self == Self::default()
    }

    /// Returns whether the link has an effect on messages.
    #[must_use]
    pub fn has(&self, effect: LinkEffect) -> bool {
        match effect {
            LinkEffect::Cut => self.cut,
            LinkEffect::Loss => self.drop > Probability::NEVER,
            LinkEffect::Hold => self.hold,
            LinkEffect::Delay => {
                let late = self.delay > SimTime::ZERO || self.jitter > SimTime::ZERO;
                late || self.reorder > Probability::NEVER
            }
            LinkEffect::Copy => self.duplicate > Probability::NEVER,
            LinkEffect::Corruption => self.corrupt > Probability::NEVER,
        }
    }

    /// Returns the effect that decided the delivery of a message that was listed in this state. `None` if no effect did:
    /// the message was received at once, it was lost on the network or by a full queue, or it was due when the
    /// receiver did not take part. A late reception has none either, because [`Delivery::Pending`] precedes it. The radio
    /// channel of the scenario is no fault, so fading and obstacles have none.
    #[must_use]
    pub fn effect_behind(&self, delivery: Delivery) -> Option<LinkEffect> {
        let effect = match delivery {
            Delivery::Cut => LinkEffect::Cut,
            Delivery::Dropped => LinkEffect::Loss,
            // A hold precedes delays and reordering.
            Delivery::Pending if self.hold => LinkEffect::Hold,
            Delivery::Pending => LinkEffect::Delay,
            Delivery::Duplicate => LinkEffect::Copy,
            Delivery::Corrupted | Delivery::Damaged => LinkEffect::Corruption,
            Delivery::Received
            | Delivery::Lost
            | Delivery::Delayed
            | Delivery::Faded
            | Delivery::Blocked => return None,
        };
        self.has(effect).then_some(effect)
    }

    /// Combines two states. Delays add up, and probabilities are independent of each other.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            cut: self.cut || other.cut,
            hold: self.hold || other.hold,
            drop: self.drop.or(other.drop),
            delay: self.delay + other.delay,
            jitter: self.jitter + other.jitter,
            duplicate: self.duplicate.or(other.duplicate),
            reorder: self.reorder.or(other.reorder),
            blocked: self.blocked || other.blocked,
            fade: self.fade.or(other.fade),
            corrupt: self.corrupt.xor(other.corrupt),
            checksum: self.checksum || other.checksum,
        }
    }
}

/// An effect of a link on a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkEffect {
    Cut,
    Loss,
    Hold,
    /// A delay, jitter or overtaking.
    Delay,
    /// A second copy of the message.
    Copy,
    /// Bit errors in the message.
    Corruption,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_decide_and_combine() {
        assert!(!Probability::NEVER.hits(0));
        assert!(Probability::ALWAYS.hits(u32::MAX));
        assert!(Probability::from_share(0.5).hits((1 << 31) - 1));
        assert!(!Probability::from_share(0.5).hits(1 << 31));
        assert_eq!(Probability::from_share(f64::NAN), Probability::NEVER);
        assert_eq!(Probability::from_share(7.0), Probability::ALWAYS);
        let (half, third) = (Probability::from_share(0.5), Probability::from_share(0.25));
        assert_eq!(half.or(third), Probability::from_share(0.625));
        assert_eq!(half.or(Probability::NEVER), half);
        assert_eq!(half.or(Probability::ALWAYS), Probability::ALWAYS);
        assert_eq!(third.xor(third), Probability::from_share(0.375));
        assert_eq!(third.xor(Probability::NEVER), third);
        assert_eq!(
            Probability::ALWAYS.xor(Probability::ALWAYS),
            Probability::NEVER
        );
    }

    #[test]
    fn states_add_up() {
        let late = LinkState {
            delay: SimTime(100),
            jitter: SimTime(50),
            ..LinkState::default()
        };
        let cut = LinkState {
            cut: true,
            delay: SimTime(10),
            ..LinkState::default()
        };
        let both = late.and(cut);
        assert!(both.cut && !both.hold && !both.is_clear());
        assert_eq!((both.delay, both.jitter), (SimTime(110), SimTime(50)));
        assert_eq!(
            LinkState::default().and(LinkState::default()),
            LinkState::default()
        );
        assert!(LinkState::default().is_clear());
    }
}
