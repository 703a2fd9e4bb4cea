//! Nothing that a team keeps grows without bound, whatever its allocator: a mission that never ends, of whose messages 60 % are lost.
//!
//! Some thousand ticks as a normal test; `ENDLESS_TICKS=1000000 cargo test --locked --workspace --test missions -- endless --nocapture`
//! for the whole thing.

use alliance_proto::log::{LogLevel, Memory};
use alliance_proto::scenario::{Scenario, Setup};
use in_process::Team;
use missions::Registry;

/// What may be kept more after the second half than after the first, bytes: a list that has doubled once. What grows by a byte in each
/// tick is seen in a hundred thousand.
const LEVEL_BYTES: i64 = 16 * 1024;

#[test]
fn nothing_grows_by_any_allocator() {
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
        let mut team = Team::new(setup, LogLevel::Off, Memory::default()).unwrap();
        let mut half = || {
            let kept = allocation_counter::measure(|| {
                for _ in 0..ticks / 2 {
                    assert!(team.tick().unwrap().is_none(), "{name}: it never ends");
                }
            });
            kept.bytes_current
        };
        let (first, second) = (half(), half());
        println!("{name}: {first} bytes more after the first half, {second} after the second");
        assert!(second <= LEVEL_BYTES, "{name}: {second} bytes more");
    }
}
