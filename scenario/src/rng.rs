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
    // The purpose has bits 32 to 39. A rank has up to 24 bits, of which the upper eight follow it.
    let [sender, receiver] = [sender, receiver].map(|robot| u64::from(robot.0));
    let lower = (sender & 0xFFFF) << 16 | (receiver & 0xFFFF);
    let upper = (sender >> 16) << 48 | (receiver >> 16) << 40;
    numbered_stream(seed, purpose, upper | lower)
}

fn numbered_stream(seed: u64, purpose: Purpose, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((u64::from(purpose as u32) << 32) | number);
    rng
}
