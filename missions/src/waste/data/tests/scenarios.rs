//! The built-in scenarios of all missions.

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
