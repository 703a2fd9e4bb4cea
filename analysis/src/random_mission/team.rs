//! Random teams of robots.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::Robot;

/// Draws a team of `count` robots, `r1`, `r2`, …, each with or without a side sensor. If robots may be absent at the
/// start, the first one never is.
#[must_use]
pub fn team(count: u32, may_be_absent: bool, rng: &mut ChaCha8Rng) -> Vec<Robot> {
    let robots = (1..=count).map(|number| {
        let side_sensor = rng.random_bool(0.5);
        let absent = rng.random_bool(0.1);
        Robot {
            name: format!("r{number}"),
            side_sensor,
            absent: absent && may_be_absent && number > 1,
            ..Robot::default()
        }
    });
    robots.collect()
}
