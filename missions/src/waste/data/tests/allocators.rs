//! The choice of allocators, and the statements about their parameters.

use scenario::ids::RobotId;
use scenario::testkit::refusals;
use scenario::{AllocatorSpec, ParameterDefault, ParameterRange, ParameterSpec};
use scenario::{Scenario, SetupFile, Vocabulary};
use serde_json::json;

use crate::fixtures::resolve;
use crate::waste::data::default_scenario;

fn parameter(key: &'static str, range: ParameterRange) -> ParameterSpec {
    ParameterSpec::new(key, "", ParameterDefault::Required, "", range)
}

fn vocabulary() -> Vocabulary {
    let nearest = AllocatorSpec {
        name: "nearest",
        about: "the nearest task",
        parameters: [
            ParameterSpec {
                unit: "s",
                ..parameter("patience_s", ParameterRange::Above(0.0, 10.0))
            },
            parameter("bids", ParameterRange::Whole(1, 9)),
            parameter("greedy", ParameterRange::Flag),
            parameter("tie", ParameterRange::Choice(&["low", "high"])),
        ]
        .into(),
        ..AllocatorSpec::alliance()
    };
    let market = AllocatorSpec {
        name: "market",
        about: "auctions",
        parameters: [parameter("rounds", ParameterRange::Whole(1, 9))].into(),
        needs_ground_truth: true,
        ..AllocatorSpec::alliance()
    };
    Vocabulary {
        missions: vec![crate::waste::data::WASTE],
        allocators: vec![AllocatorSpec::alliance(), nearest, market],
    }
}

fn read(text: &str) -> Result<Scenario, String> {
    Scenario::parse("s.toml", text, &vocabulary()).map_err(|error| error.to_string())
}

#[test]
fn a_robot_uses_its_own_allocator_or_that_of_the_team() {
    let text = "allocator = 'market'\n[[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\nallocator = 'nearest'";
    let scenario = read(text).unwrap();
    let of = |rank: usize| scenario.decider_of(&scenario.robots[rank]);
    assert_eq!((of(0), of(1)), ("market", "nearest"));
    let default = default_scenario();
    assert_eq!(default.decider_of(&default.robots[0]), "alliance");
    let json = serde_json::to_value(default).unwrap();
    assert!(json.get("allocator").is_none() && json.get("allocators").is_none());
}

#[test]
fn stated_allocator_parameters_are_kept() {
    let text = "[allocators.nearest]\npatience_s = 2\nbids = 3\ngreedy = true\ntie = 'low'";
    let scenario = read(text).unwrap();
    let stated = json!({"patience_s": 2, "bids": 3, "greedy": true, "tie": "low"});
    assert_eq!(scenario.allocator_values("nearest"), stated);
    assert_eq!(scenario.allocator_values("market"), json!({}));
    let setup = resolve(scenario);
    let json = serde_json::to_string(&setup).unwrap();
    let file: SetupFile = serde_json::from_str(&json).unwrap();
    assert_eq!(file.read(&vocabulary()).unwrap(), setup);
}

#[test]
fn mistakes_have_file_line_and_remedy() {
    let texts = [
        "allocator = 'nearst'",
        "[[robots]]\nname = 'a'\nallocator = 'x'",
        "[allocators.greedy]",
        "[allocators.nearest]\nbid = 1",
        "[allocators.market]\nbids = 1",
        "[allocators.alliance]\npreset = 'team'",
        "[allocators.nearest]\npatience_s = 0",
        "[allocators.nearest]\npatience_s = nan",
        "[allocators.nearest]\nbids = 1.5",
        "[allocators.nearest]\ngreedy = 'yes'",
        "[allocators.nearest]\ntie = 'lo'",
        "[allocators.nearest]\ntie = 3",
    ];
    let answers = refusals("s.toml", texts, read);
    insta::assert_snapshot!(answers);
}

#[test]
fn only_robots_of_allocators_that_request_it_receive_the_ground_truth() {
    let receivers = |text: &str| vocabulary().ground_truth_robots(&read(text).unwrap());
    assert_eq!(receivers(""), []);
    assert_eq!(receivers("allocator = 'nearest'"), []);
    assert_eq!(receivers("allocator = 'market'"), [0, 1, 2].map(RobotId));
    let mixed = "[[robots]]\nname = 'blue'\n[[robots]]\nname = 'gold'\nallocator = 'market'\n";
    assert_eq!(receivers(mixed), [RobotId(1)]);
}
