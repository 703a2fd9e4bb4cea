//! The built-in scenarios of all missions.

use xxhash_rust::xxh3::xxh3_64;

use crate::Registry;
use crate::fixtures::{parse, resolve};
use crate::waste::data::default_scenario;

#[test]
fn each_one_can_be_found_and_run() {
    let vocabulary = Registry::built_in().vocabulary();
    for each in vocabulary.builtins() {
        assert_eq!(vocabulary.builtin(each.name), Some(each));
        let scenario = parse(each.text);
        assert!(!scenario.description.is_empty(), "{}", each.name);
        resolve(scenario);
    }
    assert_eq!(vocabulary.builtin("no-such-scenario"), None);
    let default = vocabulary.builtin("waste-cleanup").unwrap();
    let mut default = parse(default.text);
    default.description.clear();
    assert_eq!(default, default_scenario());
}

/// The digests are those of the scenarios in which each robot has its own table. So short forms change no run.
#[test]
fn short_forms_leave_the_built_in_scenarios_as_they_were() {
    let digest = |text: &str| xxh3_64(parse(text).to_toml().unwrap().as_bytes());
    let vocabulary = Registry::built_in().vocabulary();
    let digests = vocabulary.builtins();
    let digests = digests.map(|each| format!("{:016x} {}\n", digest(each.text), each.name));
    insta::assert_snapshot!(digests.collect::<String>(), @"
    c53eb74f7681eec4 waste-cleanup
    eaa246c3b4d5b8d4 thesis-no-interruption
    22f6341865545729 thesis-trapped-robot
    d7af32745c24314a parker-specialised
    1b99f119dcbea015 foraging
    13c2a95a72654ba1 puck-moving
    06e6342ac53df33a puck-moving-unaware
    575d576532d2d522 reference
    94192ac37a0dea9f l-alliance-abstract
    35b07ec52dfda67b janitorial
    e00a6427248b65ad space-greedy
    2413bb75d244d0f3 course-project
    bb55ec27a2be32e9 sadcher-coalitions
    419ca93175cdb429 vrptw
    93ae29adfee0ba97 long-endurance
    27e4f64ef0c955a0 parker-box
    1778fa8f90934e5d cmommt
    375d5afe2c99ea6c cmommt-crowded
    ");
}

/// The example of the book has two kinds, six robots, a zone, a lossy radio and a crash in at most 35 lines.
#[test]
fn the_example_of_short_forms_stands_for_a_long_scenario() {
    const BOOK: &str = include_str!("../../../../../docs/book/scenarios.md");
    let (_, example) = BOOK
        .split_once("<!-- file: lab.toml -->\n```toml\n")
        .unwrap();
    let (example, _) = example.split_once("```").unwrap();
    assert!(example.lines().count() <= 35);
    let scenario = parse(example);
    let team: Vec<&str> = scenario
        .robots
        .iter()
        .map(|robot| robot.name.as_str())
        .collect();
    let expected = [
        "scout1", "scout2", "scout3", "hauler1", "hauler2", "hauler3",
    ];
    assert_eq!(team, expected);
    assert_eq!(scenario.obstacles[0].penetrability, 0.5);
    let long = scenario.to_toml().unwrap();
    assert_eq!(parse(&long), scenario);
    insta::assert_snapshot!("long_form", long);
}
