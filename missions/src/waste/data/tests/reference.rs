//! Checks that `reference.toml`, the manual of scenario files, is correct and complete.

use crate::Registry;
use crate::waste::data::{
    Deposit, ReportSite, Spill, Spot, WASTE, WasteSection, add_waste, default_scenario,
    default_setup, move_waste,
};
use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use scenario::fault::{Fault, FaultMix, Faults, Order, RandomFaults};
use scenario::mission::section::MissionSection;
use scenario::testkit::one_of_each;
use scenario::{
    AllianceSection, Allocators, BehaviorSection, Body, Energy, HistoryOrigin, Obstacle, Preset,
    Radio, Robot, RobotSection, Room, Scenario, Sensors, Start, StepOrder, SwitchSection,
    TaskSection,
};

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

fn parse(text: &str) -> Scenario {
    Scenario::parse("reference.toml", text, &Registry::built_in().vocabulary()).unwrap()
}

#[test]
fn it_is_the_default_scenario_but_for_the_description() {
    let reference = parse(REFERENCE);
    let description = reference.description.clone();
    let default = default_scenario();
    assert_eq!(
        reference,
        Scenario {
            description,
            ..default
        }
    );
}

#[test]
fn its_switches_are_those_of_the_default_preset() {
    let all = all();
    let preset = Preset::default();
    assert_eq!(all.step_order, Some(preset.step_order()));
    let switches = SwitchSection {
        step_order: all.step_order,
        ..all.alliance.switches
    };
    let all_of_preset = SwitchSection::from_switches(preset.switches(), preset.step_order());
    assert_eq!(switches, all_of_preset);
}

/// Returns a fault of each kind, with every mode.
fn every_fault() -> impl Iterator<Item = Fault> {
    let common = one_of_each()
        .into_iter()
        // The clean-up has no skills.
        .filter(|fault| !matches!(fault, Fault::Mission(_) | Fault::Skill(_)));
    common.chain([add_waste(3.0, 4.0, 2), move_waste(7, 3.0, 4.0)])
}

/// Returns name and mode of a fault. `reference.toml` has at most one example of each.
fn kind(fault: &Fault) -> String {
    format!("{} {}", fault.name(), fault.mode().unwrap_or_default())
}

/// docs/CONTROL.md shows every fault. This file shows faults of each group, and all of the mission's own.
#[test]
fn its_faults_are_of_every_group() {
    let shown = all();
    let orders = || shown.faults.timeline.iter();
    let kinds: BTreeSet<String> = orders().map(|order| kind(&order.fault)).collect();
    assert_eq!(kinds.len(), orders().count(), "each is shown once");
    for fault in every_fault() {
        let is_shown = match fault.kind() {
            Some(_) => orders().any(|order| order.fault.group() == fault.group()),
            None => kinds.contains(&kind(&fault)),
        };
        assert!(is_shown, "{fault}");
    }
}

#[test]
fn its_random_faults_have_the_built_in_values() {
    assert_eq!(all().faults.random, Some(RandomFaults::default()));
}

/// No `..Default` here: a new field fails to compile, and the test then requires its documentation.
fn populated() -> Scenario {
    let set = BehaviorSection {
        broadcast_rate_hz: Some(1.0),
        ceased_after_s: Some(5.0),
        fast_impatience: Some(2.0),
        slow_impatience: Some(1.0),
        slow_impatience_toward: BTreeMap::from([("x".to_owned(), 1.0)]),
        willing_to_affect_s: Some(1.0),
        willing_to_affect_toward_s: BTreeMap::from([("x".to_owned(), 1.0)]),
        before_yielding_s: Some(1.0),
        before_giving_up_s: Some(1.0),
    };
    // The keys are the same as in `defaults`, and one example suffices.
    let sets = BTreeMap::from([("x".to_owned(), BehaviorSection::default())]);
    let robot = RobotSection {
        defaults: BehaviorSection::default(),
        sets: sets.clone(),
    };
    let switches = SwitchSection {
        waiting: Some(true),
        waiting_counts: Some(true),
        wish_when_suppressed: Some(true),
        reset_stops_active: Some(true),
        history_origin: Some(HistoryOrigin::Progress),
        // The scenario's own key states the step order.
        step_order: None,
        arbitration: Some(true),
        release_message: Some(true),
        idle_heartbeat: Some(true),
    };
    let task = TaskSection {
        max_robots: Some(1),
        priority: 0,
    };
    Scenario {
        name: String::new(),
        description: String::new(),
        step_ms: 50,
        limit_s: 1.0,
        step_order: Some(StepOrder::Simultaneous),
        allocator: Some("x".to_owned()),
        room: Room {
            width_m: 1.0,
            height_m: 1.0,
        },
        body: Body {
            radius_m: 1.0,
            speed_m_s: 1.0,
            push_m_s: 1.0,
            turn_deg_s: 1.0,
            reach_m: 1.0,
            robot_penetrability: 0.0,
        },
        devices: vec!["x".to_owned()],
        skills: BTreeMap::new(),
        sensors: Sensors {
            border_range_m: 1.0,
            avoidance_range_m: 1.0,
            item_range_m: 1.0,
        },
        radio: Radio { range_m: Some(1.0) },
        energy: Some(Energy {
            capacity_j: 1.0,
            idle_w: 1.0,
            drive_w: 1.0,
        }),
        mission: MissionSection::new(
            WASTE,
            WasteSection {
                spills: vec![Spill {
                    name: String::new(),
                    items: 1,
                    x_fraction: 0.5,
                    y_fraction: 0.5,
                }],
                spill_radius_m: 1.0,
                item_radius_m: 1.0,
                deposit: Deposit {
                    radius_m: 1.0,
                    x_fraction: 0.5,
                    y_fraction: 0.5,
                },
                report_site: ReportSite {
                    width_m: 1.0,
                    height_m: 1.0,
                    color_s: 1.0,
                },
                report_period_s: 1.0,
                further_deposits: vec![Spot {
                    x_fraction: 0.5,
                    y_fraction: 0.5,
                }],
                border_known: true,
                respawn: true,
                duration_s: Some(600.0),
            },
        ),
        robots: vec![Robot {
            name: String::new(),
            side_sensor: true,
            speed_m_s: Some(1.0),
            turn_deg_s: Some(1.0),
            push_m_s: Some(1.0),
            devices: Some(vec!["x".to_owned()]),
            // The waste clean-up has no skills.
            skills: None,
            allocator: Some("x".to_owned()),
            controller: Some("x".to_owned()),
            absent: true,
            start: Some(Start {
                x_m: 1.0,
                y_m: 1.0,
                heading_deg: 0.0,
            }),
            tasks: vec!["x".to_owned()],
        }],
        faults: Faults {
            timeline: every_fault().map(Order::now).collect(),
            random: Some(RandomFaults {
                mtbf_s: 1.0,
                mttr_s: 1.0,
                mix: FaultMix {
                    kill: 1.0,
                    pause: 1.0,
                    link: 1.0,
                    sensor: 1.0,
                    actuator: 1.0,
                    power: 1.0,
                    babble: 1.0,
                },
            }),
        },
        obstacles: vec![Obstacle {
            x_m: 1.0,
            y_m: 1.0,
            width_m: 1.0,
            height_m: 1.0,
            penetrability: 0.0,
        }],
        tasks: BTreeMap::from([("x".to_owned(), task)]),
        alliance: AllianceSection {
            preset: Preset::Team,
            threshold: 100.0,
            switches,
            defaults: set,
            sets,
            robots: BTreeMap::from([("x".to_owned(), robot)]),
        },
        // These keys belong to the available allocators.
        allocators: Allocators::new(),
    }
}

/// Tables whose keys are names that a scenario chooses.
const BY_NAME: [&str; 6] = [
    "tasks",
    "alliance.sets",
    "alliance.robots",
    "alliance.robots.*.sets",
    "alliance.defaults.slow_impatience_toward",
    "alliance.defaults.willing_to_affect_toward_s",
];

/// Collects the paths of all keys below `path`, with `*` for names.
fn keys(value: &Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        Value::Array(elements) => elements.iter().for_each(|each| keys(each, path, found)),
        Value::Object(entries) => {
            for (key, value) in entries {
                let key = if BY_NAME.contains(&path) { "*" } else { key };
                let path = [path, key].join(".").trim_start_matches('.').to_owned();
                keys(value, &path, found);
                found.insert(path);
            }
        }
        _ => {}
    }
}

#[test]
fn it_has_every_key() {
    let (mut known, mut shown) = (BTreeSet::new(), BTreeSet::new());
    keys(&serde_json::to_value(populated()).unwrap(), "", &mut known);
    let reference: toml::Value = toml::from_str(&with_optional_keys()).unwrap();
    keys(&serde_json::to_value(reference).unwrap(), "", &mut shown);
    let missing: Vec<_> = known.difference(&shown).collect();
    assert!(missing.is_empty(), "not in reference.toml: {missing:?}");
}

#[test]
fn its_table_has_the_built_in_values() {
    let blue = &default_setup(1).alliance.robots["blue"];
    for (name, set) in &blue.sets {
        let row_name = name
            .split_once('(')
            .map_or(name.clone(), |(kind, _)| format!("{kind}(NAME)"));
        let row = REFERENCE
            .lines()
            .find_map(|line| line.strip_prefix("#   ")?.strip_prefix(&row_name));
        let numbers: Vec<f64> = row
            .unwrap()
            .split_whitespace()
            .map(|cell| cell.parse().unwrap())
            .collect();
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
