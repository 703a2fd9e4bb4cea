//! The built-in scenarios of the clean-up.

use scenario::{Scenario, Setup};

use crate::Registry;
use crate::waste::data::default_scenario;

#[test]
fn each_one_can_be_found_and_run() {
    let vocabulary = Registry::built_in().vocabulary();
    for each in vocabulary.builtins() {
        assert_eq!(vocabulary.builtin(each.name), Some(each));
        let scenario = Scenario::parse(each.name, each.text, &vocabulary).unwrap();
        assert!(!scenario.description.is_empty(), "{}", each.name);
        Setup::resolve(scenario, 1, None).unwrap();
    }
    assert_eq!(vocabulary.builtin("no-such-scenario"), None);
}

#[test]
fn the_default_mission_equals_the_default_scenario_except_for_the_description() {
    let vocabulary = Registry::built_in().vocabulary();
    let mission = vocabulary.builtin("waste-cleanup").unwrap();
    let scenario = Scenario::parse(mission.name, mission.text, &vocabulary).unwrap();
    let description = scenario.description.clone();
    let default = default_scenario();
    assert_eq!(
        scenario,
        Scenario {
            description,
            ..default
        }
    );
}
