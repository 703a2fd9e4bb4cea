//! The memory of a team does not grow without bound for any allocator: an endless mission with 60 % message loss.
//!
//! A normal test runs some thousand ticks. For a full check:
//! `ENDLESS_TICKS=1000000 cargo test --locked --workspace --test missions -- endless --nocapture`.

use alliance_tests::runs::{allocators, parse, setup, team};
use run_log::LogLevel;

/// The allowed growth in the second half, in bytes: a few doublings of lists. With 100,000 ticks the test detects a
/// growth of one byte per tick.
const LEVEL_BYTES: i64 = 32 * 1024;

#[test]
fn memory_does_not_grow_with_any_allocator() {
    let ticks: u64 = std::env::var("ENDLESS_TICKS").map_or(6_000, |text| text.parse().unwrap());
    for name in allocators() {
        let text = format!(
            "allocator = '{name}'\nlimit_s = 100000\n[waste]\nrespawn = true\n\
             [[faults.timeline]]\nat_s = 0\n\
             fault.drop = {{ from = 'all', to = 'all', p = 0.6 }}\n"
        );
        let mut team = team(setup(parse(&text), 1), LogLevel::Off);
        let mut half = || {
            let kept = allocation_counter::measure(|| {
                for _ in 0..ticks / 2 {
                    assert!(
                        team.tick().unwrap().is_none(),
                        "{name}: the mission must not end"
                    );
                }
            });
            kept.bytes_current
        };
        let (first, second) = (half(), half());
        println!("{name}: {first} bytes more after the first half, {second} after the second");
        assert!(second <= LEVEL_BYTES, "{name}: {second} bytes more");
    }
}
