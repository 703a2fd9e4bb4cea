//! Random rooms for missions in one process.

use analysis::random_mission::room::obstacles;
use missions::waste::data::default_scenario;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::Scenario;

/// Returns the default mission with 1 to 8 obstacles at random positions.
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
