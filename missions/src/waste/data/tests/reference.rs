//! Checks that `reference.toml`, the manual of scenario files, is correct and complete.

use std::collections::{BTreeMap, BTreeSet};

use scenario::fault::RandomFaults;
use scenario::{Preset, Scenario, SwitchSection};
use toml::{Table, Value};

use crate::Registry;
use crate::fixtures::{parse, read};
use crate::waste::data::{default_scenario, default_setup};

const REFERENCE: &str = include_str!("../../scenarios/reference.toml");

/// Uncomments the optional keys: they begin with `#` alone, comments with `# `.
fn with_optional_keys() -> String {
    let uncommented = REFERENCE.lines().map(|line| match line.strip_prefix('#') {
        Some(rest) if !rest.is_empty() && !rest.starts_with(' ') => rest,
        _ => line,
    });
    uncommented.collect::<Vec<_>>().join("\n")
}

/// Returns the scenario with its optional keys, which can be used as shown.
fn all() -> Scenario {
    parse(&with_optional_keys())
}

#[test]
fn it_is_the_default_scenario_but_for_the_description() {
    let reference = parse(REFERENCE);
    let description = reference.description.clone();
    let default = default_scenario();
    let default = Scenario {
        description,
        ..default
    };
    assert_eq!(reference, default);
}

#[test]
fn its_switches_are_those_of_the_default_preset() {
    let all = all();
    let preset = Preset::default();
    let switches = SwitchSection {
        step_order: all.step_order,
        ..all.alliance.switches
    };
    let all_of_preset = SwitchSection::from_switches(preset.switches(), preset.step_order());
    assert_eq!(switches, all_of_preset);
}

#[test]
fn its_faults_differ_and_its_random_faults_are_the_built_in_ones() {
    let faults = all().faults;
    let shown = faults.timeline.iter().map(|order| order.fault.name());
    let names: BTreeSet<&str> = shown.collect();
    assert_eq!(names.len(), faults.timeline.len());
    assert_eq!(faults.random, Some(RandomFaults::default()));
}

/// A key of no table, and unlike every key.
const UNKNOWN: &str = "a-key-that-resembles-no-key-of-any-table";

/// Keys that belong elsewhere: the clean-up has no skills, the step order is a key of the scenario, and the parameters
/// of each allocator have their own documents.
const ELSEWHERE: [&str; 5] = [
    "skills",
    "robots.skills",
    "robots.capacity",
    "alliance.switches.step_order",
    "allocators",
];

/// Adds the keys of a table to `shown`, and all keys that it may have to `known`: the reader of a scenario lists them
/// when it rejects an unknown key. Does the same for all tables below.
fn collect_keys(
    path: &[String],
    whole: &Table,
    shown: &mut BTreeMap<String, BTreeSet<String>>,
    known: &mut BTreeMap<String, BTreeSet<String>>,
) {
    let mut changed = Value::Table(whole.clone());
    let table = path.iter().fold(&mut changed, |value, key| match value {
        Value::Array(elements) => &mut elements[key.parse::<usize>().unwrap()],
        value => &mut value[key.as_str()],
    });
    let keys: Vec<String> = match table {
        Value::Table(table) => table.keys().cloned().collect(),
        Value::Array(elements) => (0..elements.len()).map(|index| index.to_string()).collect(),
        _ => return,
    };
    if let Value::Table(table) = table {
        table.insert(UNKNOWN.to_owned(), Value::Integer(1));
        let place = place(path);
        shown.entry(place.clone()).or_default().extend(keys.clone());
        let error = read(&toml::to_string(&changed).unwrap())
            .unwrap_err()
            .to_string();
        if let Some((_, list)) = error.split_once("unknown key; there ") {
            let list = list
                .trim_start_matches("are ")
                .trim_start_matches("is only ");
            let names = list
                .split(", ")
                .map(|name| name.trim_matches('\'').to_owned());
            known.entry(place).or_default().extend(names);
        }
    }
    for key in keys {
        collect_keys(&[path, &[key]].concat(), whole, shown, known);
    }
}

/// Returns the name of a table. The tables of a list have one name, and so have all tables of ALLIANCE parameters. A
/// kind has the keys of a robot.
fn place(path: &[String]) -> String {
    let keys = path.iter().filter(|key| key.parse::<usize>().is_err());
    let keys: Vec<&str> = keys.map(String::as_str).collect();
    match keys[..] {
        ["alliance", "sets", _] | ["alliance", "robots", _, "sets", _] => {
            "alliance.defaults".to_owned()
        }
        ["alliance", "robots", _, "defaults"] => "alliance.defaults".to_owned(),
        ["kinds", _] => "robots".to_owned(),
        _ => keys.join("."),
    }
}

#[test]
fn it_has_every_key() {
    let whole: Table = toml::from_str(&with_optional_keys()).unwrap();
    let (mut shown, mut known) = (BTreeMap::new(), BTreeMap::new());
    collect_keys(&[], &whole, &mut shown, &mut known);
    assert!(known.len() > 20, "{known:?}");
    let missions = Registry::built_in().vocabulary().missions;
    for (table, known) in known {
        for key in known.difference(&shown[&table]) {
            let key = [table.as_str(), key].join(".");
            let key = key.trim_start_matches('.');
            let is_mission = missions.iter().any(|mission| mission.name() == key);
            assert!(
                is_mission || ELSEWHERE.contains(&key),
                "not in reference.toml: {key}"
            );
        }
    }
}

#[test]
fn its_table_has_the_built_in_values() {
    let blue = &default_setup(1).alliance.robots["blue"];
    for (name, set) in &blue.sets {
        let row_name = match name.split_once('(') {
            Some((kind, _)) => format!("{kind}(NAME)"),
            None => name.clone(),
        };
        let mut lines = REFERENCE.lines();
        let row = lines.find_map(|line| line.strip_prefix("#   ")?.strip_prefix(&row_name));
        let cells = row.unwrap().split_whitespace();
        let numbers: Vec<f64> = cells.map(|cell| cell.parse().unwrap()).collect();
        let built_in = [
            set.broadcast_rate_hz,
            set.ceased_after_s,
            set.fast_impatience,
            set.slow_impatience["gold"],
            set.willing_to_affect_s["gold"],
            set.before_yielding_s,
            set.before_giving_up_s,
        ];
        assert_eq!(numbers, built_in, "{name}");
    }
}
