//! Random number streams: one ChaCha stream per purpose and robot or link. No consumer shifts another's random numbers.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::ids::RobotId;

/// The purpose of a random stream. The numbers are part of every recorded run: never reuse one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// The places of a mission's items.
    Items = 1,
    /// The choices of a robot's behaviors.
    Behavior = 2,
    /// The delivery of messages on a link.
    Link = 3,
    /// Bursts of losses on a link.
    Burst = 4,
    /// Errors of a robot's sensors.
    Sensor = 5,
    /// Random faults of a robot.
    RandomFaults = 6,
    /// Other random choices of a mission.
    Mission = 7,
    /// The motion of targets that move on their own.
    Targets = 8,
    /// The random choices of a robot's allocator.
    Allocation = 9,
    /// Bit errors of messages on a link.
    Corruption = 10,
    /// The drawn starts of robots.
    Start = 11,
    /// The drawn places of a mission.
    Layout = 12,
}

/// Returns the stream of a purpose that belongs to no robot.
#[must_use]
pub fn stream(seed: u64, purpose: Purpose) -> ChaCha8Rng {
    numbered_stream(seed, purpose, 0)
}

#[must_use]
pub fn robot_stream(seed: u64, purpose: Purpose, robot: RobotId) -> ChaCha8Rng {
    numbered_stream(seed, purpose, u64::from(robot.0) + 1)
}

/// Returns the stream of a purpose for one directed link. A purpose has streams of robots or of links, never both.
#[must_use]
pub fn link_stream(seed: u64, purpose: Purpose, sender: RobotId, receiver: RobotId) -> ChaCha8Rng {
    numbered_stream(seed, purpose, link_number(sender, receiver))
}

/// Returns the number of a link. It leaves bits 32 to 39 for the purpose. The upper eight of the 24 bits of a rank follow
/// them.
fn link_number(sender: RobotId, receiver: RobotId) -> u64 {
    let [sender, receiver] = [sender, receiver].map(|robot| u64::from(robot.0));
    let lower = (sender & 0xFFFF) << 16 | (receiver & 0xFFFF);
    (sender >> 16) << 48 | (receiver >> 16) << 40 | lower
}

fn numbered_stream(seed: u64, purpose: Purpose, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((u64::from(purpose as u32) << 32) | number);
    rng
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::MAX_ROBOTS;

    proptest! {
        /// Both ranks follow from the number, so that no two links share a stream.
        #[test]
        fn each_link_has_its_own_number(ranks in [0..MAX_ROBOTS as u32, 0..MAX_ROBOTS as u32]) {
            let [sender, receiver] = ranks;
            let number = link_number(RobotId(sender), RobotId(receiver));
            let part = |low: u32, high: u32| (number >> low & 0xFFFF) as u32 | ((number >> high & 0xFF) as u32) << 16;
            prop_assert_eq!([part(16, 48), part(0, 40)], ranks);
            prop_assert_eq!(number >> 32 & 0xFF, 0, "the place of the purpose");
        }
    }
}
