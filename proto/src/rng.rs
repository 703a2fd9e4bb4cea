//! One ChaCha stream per purpose and robot or link, so that no consumer shifts another's random numbers (DESIGN §5).

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::ids::RobotId;

/// What a stream of random numbers is for. The numbers are part of every recorded run: never reuse one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// Where a mission lays its items.
    Items = 1,
    /// A robot's own choices.
    Behavior = 2,
    /// The delivery of messages on a link.
    Link = 3,
    /// Bursts of losses on a link.
    Burst = 4,
    /// Errors of a robot's sensors.
    Sensor = 5,
    /// Random faults of a robot.
    Campaign = 6,
    /// What else a mission draws.
    Mission = 7,
    /// How something moves that moves by itself.
    Targets = 8,
    /// What a robot's allocator draws.
    Allocation = 9,
}

/// The stream of that purpose that belongs to no robot.
#[must_use]
pub fn stream(seed: u64, purpose: Purpose) -> ChaCha8Rng {
    numbered(seed, purpose, 0)
}

/// The stream of that purpose of one robot.
#[must_use]
pub fn robot_stream(seed: u64, purpose: Purpose, robot: RobotId) -> ChaCha8Rng {
    numbered(seed, purpose, u32::from(robot.0) + 1)
}

/// The stream of that purpose of one directed link. A purpose has streams of robots or of links, never both.
#[must_use]
pub fn link_stream(seed: u64, purpose: Purpose, sender: RobotId, receiver: RobotId) -> ChaCha8Rng {
    let link = u32::from(sender.0) << 16 | u32::from(receiver.0);
    numbered(seed, purpose, link)
}

fn numbered(seed: u64, purpose: Purpose, number: u32) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((u64::from(purpose as u32) << 32) | u64::from(number));
    rng
}
