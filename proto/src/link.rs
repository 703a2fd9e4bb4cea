//! The state of a radio link in a tick, as the world tells it to the receiver, whose radio applies it (DESIGN §4, §6).

use serde::{Deserialize, Serialize};

use crate::time::SimTime;

/// A probability in parts of 2³², so that a draw of 32 bits decides it the same way everywhere.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Probability(u64);

impl Probability {
    /// It never happens.
    pub const NEVER: Self = Self(0);
    /// It always happens.
    pub const ALWAYS: Self = Self(1 << 32);

    /// The nearest to that share; what is outside 0 to 1 counts as the nearer of them, and NaN as 0.
    #[must_use]
    pub fn of(share: f64) -> Self {
        Self((share.clamp(0.0, 1.0) * (1_u64 << 32) as f64).round() as u64)
    }

    /// Whether a draw of 32 random bits makes it happen.
    #[must_use]
    pub fn decides(self, draw: u32) -> bool {
        u64::from(draw) < self.0
    }

    /// The probability that this or that happens, independently of each other.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        // At most 2³² each, so the product of the complements fits into 64 bits.
        let neither = u128::from((1 << 32) - self.0) * u128::from((1 << 32) - other.0);
        Self((1 << 32) - (neither >> 32) as u64)
    }
}

/// What befalls the messages of one sender at one receiver in one tick. The default is an undisturbed link.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct LinkState {
    /// Nothing gets through: mute, deaf, partition or out of range.
    pub cut: bool,
    /// What comes is held back for as long as the sender is among [`crate::tick::TickMessage::held`].
    pub hold: bool,
    /// Loss of each message.
    pub drop: Probability,
    /// Delay of each message.
    pub delay: SimTime,
    /// Up to this much more.
    pub jitter: SimTime,
    /// A second copy of each message.
    pub duplicate: Probability,
    /// Each message is overtaken by the next one of its sender.
    pub reorder: Probability,
}

impl LinkState {
    /// Whether it changes nothing.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a message that is not held may come late.
    #[must_use]
    pub fn may_delay(&self) -> bool {
        let late = self.delay > SimTime::ZERO || self.jitter > SimTime::ZERO;
        late || self.reorder > Probability::NEVER
    }

    /// Both states at once: delays add up, chances are independent of each other.
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
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_decide_and_combine() {
        assert!(!Probability::NEVER.decides(0));
        assert!(Probability::ALWAYS.decides(u32::MAX));
        assert!(Probability::of(0.5).decides((1 << 31) - 1));
        assert!(!Probability::of(0.5).decides(1 << 31));
        assert_eq!(Probability::of(f64::NAN), Probability::NEVER);
        assert_eq!(Probability::of(7.0), Probability::ALWAYS);
        let (half, third) = (Probability::of(0.5), Probability::of(0.25));
        assert_eq!(half.or(third), Probability::of(0.625));
        assert_eq!(half.or(Probability::NEVER), half);
        assert_eq!(half.or(Probability::ALWAYS), Probability::ALWAYS);
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
