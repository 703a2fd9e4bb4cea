//! The memory of a team does not grow without bound for any allocator: an endless mission with 60 % message loss.
//!
//! A normal test runs some thousand ticks. For a full check:
//! `ENDLESS_TICKS=1000000 cargo test --locked --workspace --test missions -- endless --nocapture`.

use in_process::Team;
use missions::Registry;
use run_log::{LogLevel, MemoryLog};
use scenario::{Scenario, Setup};

/// The allowed growth in the second half, in bytes: one doubling of a list. With 100,000 ticks the test detects a
/// growth of one byte per tick.
const LEVEL_BYTES: i64 = 16 * 1024;

#[test]
fn memory_does_not_grow_with_any_allocator() {
    let ticks: u64 = std::env::var("ENDLESS_TICKS").map_or(12_000, |text| text.parse().unwrap());
    let known = Registry::built_in().vocabulary();
    for allocator in &known.allocators {
        let name = allocator.name;
        let text = format!(
            "allocator = '{name}'\nlimit_s = 100000\n[waste]\nrespawn = true\n\
             [[faults.timeline]]\nat_s = 0\n\
             fault.drop = {{ from = 'all', to = 'all', p = 0.6 }}\n"
        );
        let scenario = Scenario::parse("endless.toml", &text, &known).unwrap();
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
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
