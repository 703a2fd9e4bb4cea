//! Random rooms for closed-loop tests.

use alliance_proto::scenario::Scenario;
use missions::waste::data::default_scenario;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use study::random_mission::room::obstacles;

/// The default mission with 1 to 8 obstacles at random places.
#[must_use]
pub fn random_room(seed: u64) -> Scenario {
    let mut scenario = Scenario {
        name: format!("room-{seed}"),
        ..default_scenario()
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = rng.random_range(1..=8);
    scenario.obstacles = obstacles(&scenario, count, &mut rng);
    scenario
}
