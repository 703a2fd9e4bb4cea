//! Tests of the fault vocabulary in every form.

use super::*;
use crate::Catalog;
use crate::testkit::bincode_round_trip;
use crate::testkit::{default_scenario, examples_of, one_of_each};

#[test]
fn every_fault_survives_bincode_and_json() {
    for fault in one_of_each() {
        let order = Order {
            when: Some("any delivers item-3".parse().unwrap()),
            for_s: Some(3.0),
            ..Order::now(fault)
        };
        assert_eq!(bincode_round_trip(&order), order);
        let json = serde_json::to_string(&order).unwrap();
        assert_eq!(
            serde_json::from_str::<Order>(&json).unwrap(),
            order,
            "{json}"
        );
        let key = format!(r#""fault":{{"{}":"#, order.fault.name());
        assert!(json.contains(&key), "{json}");
    }
}

#[test]
fn the_default_team_accepts_every_fault() {
    let scenario = default_scenario();
    // The team has no absent robot, and a skill of its own.
    let accepted = |fault: &Fault| !matches!(fault, Fault::Add(_) | Fault::Skill(_));
    for fault in one_of_each().into_iter().filter(accepted) {
        let order = Order::now(fault);
        assert_eq!(
            order.check(&scenario, &Catalog::new(&scenario)),
            Ok(()),
            "{order}"
        );
    }
}

#[track_caller]
fn refused(json: &str, line: &str) {
    let order: Order = serde_json::from_str(json).unwrap();
    let scenario = default_scenario();
    let error = order
        .check(&scenario, &Catalog::new(&scenario))
        .unwrap_err();
    assert_eq!(error.to_string(), line);
}

#[test]
fn mistakes_name_field_problem_and_remedy() {
    refused(
        r#"{"fault":{"kill":"glod"}}"#,
        "fault.kill: the scenario has no robot 'glod'; did you mean 'gold'? (there are blue, gold, green)",
    );
    refused(
        r#"{"fault":{"kill":"executing:move-spil(top)"}}"#,
        "fault.kill: there is no behavior set 'move-spil(top)'; there are find-methodical, find-wander, move(top), move(bottom), report",
    );
    refused(
        r#"{"fault":{"restart":"executing:move-spill(top)"}}"#,
        "fault.restart: 'restart' cannot target a role; name a robot, or use one of kill, terminate, pause, remove, mute, deaf, power, babble",
    );
    refused(
        r#"{"fault":{"move-robot":{"robot":"idle","x_m":1,"y_m":1}}}"#,
        "fault.move-robot: 'move-robot' cannot target a role; name a robot, or use one of kill, terminate, pause, remove, mute, deaf, power, babble",
    );
    refused(
        r#"{"fault":{"add":"gold"}}"#,
        "fault.add: 'gold' is in the mission from its start; name a robot that the scenario marks as absent: there are none",
    );
    refused(
        r#"{"fault":{"drop":{"p":1.5}}}"#,
        "fault.drop.p: 1.5 is out of range; it must be at least 0 and at most 1",
    );
    refused(
        r#"{"fault":{"drop":{"to":"red","p":0.5}}}"#,
        "fault.drop.to: the scenario has no robot 'red'; there are blue, gold, green",
    );
    refused(
        r#"{"fault":{"sensor":{"robot":"blue","device":"hand","mode":{"noise":{"m":1}}}}}"#,
        "fault.sensor.mode: 'hand' does not measure lengths; use dead, stuck or dropout",
    );
    refused(
        r#"{"fault":{"shake":{"x_m":13,"y_m":1}}}"#,
        "fault.shake.x_m: 13 is out of range; it must be at least 0 and at most 12 m",
    );
    refused(
        r#"{"fault":{"shake":{"x_m":1,"y_m":1}},"for_s":3}"#,
        "for_s: 'shake' is instantaneous; omit the duration",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"every_s":3}"#,
        "every_s: the fault repeats but never heals; give it a duration",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"every_s":3,"for_s":3}"#,
        "for_s: 3 s is not shorter than the interval of 3 s; make it heal before it repeats",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"when":"gold activates repor"}"#,
        "when: there is no behavior set 'repor'; did you mean 'report'? (there are \
         find-methodical, find-wander, move(top), move(bottom), report)",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"when":"gold dies","at_s":3}"#,
        "when: both an event and a time trigger the fault; give only one of them",
    );
    refused(
        r#"{"fault":{"drop":{"from":"blue","to":"blue","p":0.5}}}"#,
        "fault.drop.to: 'blue' does not receive its own messages; name two robots, or all",
    );
    refused(
        r#"{"fault":{"sensor":{"robot":"gold","device":"side-border","mode":"dead"}}}"#,
        "fault.sensor.device: 'gold' has no 'side-border'; name one that has it: there is only 'blue'",
    );
    for (x_m, wrong) in [(100, "is outside"), (-1, "fills")] {
        let obstacle = format!(
            r#"{{"fault":{{"obstacle":{{"x_m":{x_m},"y_m":-1,"width_m":50,"height_m":50}}}}}}"#
        );
        refused(
            &obstacle,
            &format!(
                "fault.obstacle: the obstacle {wrong} the room; the room is 12 m wide and 9 m high"
            ),
        );
    }
    refused(
        r#"{"fault":{"partition":{"groups":[["blue"],["gold","blue"]]}}}"#,
        "fault.partition.groups: 'blue' is in two groups; name it once",
    );
}

#[test]
fn events_are_parsed_from_text() {
    let when: EventTrigger = "blue activates move(top)".parse().unwrap();
    let expected = EventTrigger {
        robot: Some("blue".to_owned()),
        what: TriggerEvent::Activates.as_str().to_owned(),
        subject: Some("move(top)".to_owned()),
    };
    assert_eq!(when, expected);
    assert_eq!(when.to_string(), "blue activates move(top)");
    refused(
        r#"{"fault":{"mute":"blue"},"when":"gold naps"}"#,
        "when: there is no event 'naps'; there are activates, hibernates, waits, does, joins, dies",
    );
    let any = EventTrigger {
        robot: None,
        what: "delivers".to_owned(),
        subject: None,
    };
    assert_eq!("any  delivers".parse(), Ok(any));
    for wrong in ["", "blue", "blue dies twice", "blue picks a b"] {
        assert!(wrong.parse::<EventTrigger>().is_err(), "{wrong}");
    }
}

#[test]
fn only_existing_skills_can_get_worse() {
    let mut scenario = default_scenario();
    let weak = std::collections::BTreeMap::from([("lift".to_owned(), 0.0)]);
    scenario.robots[0].skills = Some(weak);
    let refused = |robot: &str, skill: &str, share: f64| {
        let fault = Fault::Skill(SkillFault {
            robot: robot.to_owned(),
            skill: skill.to_owned(),
            share,
        });
        let checked = Order::now(fault).check(&scenario, &Catalog::new(&scenario));
        checked.unwrap_err().to_string()
    };
    let (weak, other) = (&scenario.robots[0].name, &scenario.robots[1].name);
    assert_eq!(
        refused(other, "lfit", 0.3),
        "fault.skill.skill: there is no skill 'lfit'; did you mean 'lift'? (there is only 'lift')"
    );
    let line = refused(weak, "lift", 0.3);
    let expected =
        format!("fault.skill.skill: '{weak}' has no skill 'lift'; name one that has it: ");
    assert!(line.starts_with(&expected), "{line}");
    assert!(line.contains(other.as_str()), "{line}");
    for share in [-0.1, 1.1, f64::NAN] {
        assert_eq!(
            refused(other, "lift", share),
            format!(
                "fault.skill.share: {share} is out of range; it must be at least 0 and at most 1"
            )
        );
    }
}

/// Every declaration is complete: its example has its name and its target, and only instantaneous faults do not heal.
#[test]
fn declarations_agree_with_their_faults() {
    for kind in Fault::KINDS {
        let name = kind.spec.name;
        assert!(!kind.commands.is_empty(), "{name}");
        let examples = examples_of(kind);
        assert!(!examples.is_empty(), "{name}");
        for fault in examples {
            assert_eq!(fault.name(), name);
            let takes_robot = kind.spec.arguments.first() == Some(&FaultArgument::ROBOT);
            assert_eq!(fault.robot().is_some(), takes_robot, "{name}");
            let target = fault.with_target("blue");
            assert!(!kind.takes_role || target.robot() == Some("blue"), "{name}");
            let keys: Vec<&str> = kind.spec.arguments.iter().map(|each| each.key).collect();
            let values = fault.values();
            assert!(
                values.keys().all(|key| keys.contains(&key.as_str())),
                "{name}"
            );
            assert_eq!(Fault::from_values(name, values), Ok(fault));
        }
    }
}

/// Returns the table of the faults of a group.
fn table(group: FaultGroup) -> String {
    let has_healing = group == FaultGroup::Process;
    let mut rows = match has_healing {
        true => "| fault | effect | healing |\n|---|---|---|\n".to_owned(),
        false => "| fault | effect |\n|---|---|\n".to_owned(),
    };
    for kind in Fault::KINDS.iter().filter(|kind| kind.group == group) {
        for (json, effect) in kind.examples {
            rows += &format!("| `{json}` | {effect} |");
            if has_healing {
                rows += &format!(" {} |", kind.healing.unwrap_or("–"));
            }
            rows.push('\n');
        }
    }
    rows
}

/// Returns the line with the names of the matching faults.
fn names(matches: fn(&FaultKind) -> bool) -> String {
    let kinds = Fault::KINDS.into_iter().filter(|kind| matches(kind));
    let names: Vec<String> = kinds.map(|kind| format!("`{}`", kind.spec.name)).collect();
    format!("{}.\n", names.join(", "))
}

/// The tables of docs/CONTROL.md follow from the declarations. `INSTA_UPDATE=always` writes them.
#[test]
fn the_control_page_shows_the_declarations() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/CONTROL.md");
    let page = std::fs::read_to_string(path).unwrap();
    let mut expected = String::new();
    for part in page.split_inclusive("<!-- end -->") {
        let Some((text, rest)) = part.split_once("<!-- faults: ") else {
            expected += part;
            continue;
        };
        let (name, _) = rest.split_once(' ').unwrap();
        let content = match name {
            "process" => table(FaultGroup::Process),
            "radio" => table(FaultGroup::Radio),
            "robot" => table(FaultGroup::Robot),
            "world" => table(FaultGroup::World),
            "role" => names(|kind| kind.takes_role),
            "instantaneous" => names(|kind| kind.healing.is_none()),
            other => panic!("unknown table {other}"),
        };
        expected += &format!("{text}<!-- faults: {name} -->\n\n{content}\n<!-- end -->");
    }
    if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
        std::fs::write(path, &expected).unwrap();
    } else {
        assert_eq!(
            page, expected,
            "run with INSTA_UPDATE=always and review the difference"
        );
    }
}
