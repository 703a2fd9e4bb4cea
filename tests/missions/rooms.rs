//! Hard rooms by real processes: some of the 200 random rooms of `--example rooms`.

use alliance_tests::rooms::random_room;
use missions::waste::data::WasteSection;
use scenario::Scenario;

use crate::harness::Lab;

/// Three times the median duration of 200 random rooms, in s.
const RANDOM_LIMIT_S: &str = "1224";

/// Checks that the mission delivers every item.
#[track_caller]
fn assert_completes(name: &str, scenario: Scenario, limit_s: &str) {
    let items: u32 = WasteSection::of(&scenario)
        .spills
        .iter()
        .map(|spill| spill.items)
        .sum();
    let lab = Lab::new();
    let file = format!("{name}.toml");
    std::fs::write(lab.path(&file), scenario.to_toml().unwrap()).unwrap();
    let finished = lab.mission(
        "run",
        &[&file, "--limit", limit_s, "--log", "summary", "--json"],
    );
    let result = finished.expect(0).json();
    assert_eq!(result["outcome"], "complete", "{name}");
    assert_eq!(result["result"]["items"]["delivered"], items, "{name}");
    assert_eq!(result["unscripted"], false, "{name}");
}

#[test]
fn random_rooms_with_obstacles_complete() {
    for seed in [1, 7, 42, 99, 163, 200] {
        assert_completes(&format!("room-{seed}"), random_room(seed), RANDOM_LIMIT_S);
    }
}
