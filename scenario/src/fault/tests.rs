//! Tests of the fault vocabulary in every form.

use super::*;
use crate::testkit::{
    bincode_round_trip, default_scenario, entry, examples_of, one_of_each, vocabulary,
};
use crate::time::SimTime;
use crate::{Catalog, Robot, Scenario};

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
        let read: Order = serde_json::from_str(&json).unwrap();
        assert_eq!(read, order, "{json}");
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
        let checked = order.check(&scenario, &Catalog::new(&scenario));
        assert_eq!(checked, Ok(()), "{order}");
    }
}

/// Returns orders with the reasons for which the default team refuses them, for a snapshot.
fn refusals(orders: &[&str]) -> String {
    let scenario = default_scenario();
    let catalog = Catalog::new(&scenario);
    let refusal = |json: &&str| {
        let order: Order = serde_json::from_str(json).unwrap();
        let error = order.check(&scenario, &catalog).unwrap_err();
        entry(json, &error.to_string())
    };
    orders.iter().map(refusal).collect()
}

/// Each link needs memory for its bursts. Independent losses need none.
#[test]
fn bursts_among_thousands_of_robots_are_refused() {
    let mut scenario = default_scenario();
    let name = |rank| Robot {
        name: format!("r{rank}"),
        ..Robot::default()
    };
    scenario.robots = (0..2_001).map(name).collect();
    let catalog = Catalog::new(&scenario);
    let check = |fault: &str| {
        let order: Order = serde_json::from_str(&format!("{{\"fault\":{fault}}}")).unwrap();
        order
            .check(&scenario, &catalog)
            .map_err(|error| error.to_string())
    };
    let refusal = "bursts of losses among 2001 robots need too much memory; use independent losses, or at most 2000 robots";
    let bursts = check(r#"{"drop":{"p":0.5,"burst_s":1.0}}"#);
    assert_eq!(bursts, Err(format!("fault.drop.burst_s: {refusal}")));
    assert_eq!(
        check(r#"{"radio":"poor-radio"}"#),
        Err(format!("fault.radio: {refusal}"))
    );
    assert_eq!(check(r#"{"radio":"good-radio"}"#), Ok(()));
    assert_eq!(check(r#"{"drop":{"p":0.5}}"#), Ok(()));
}

#[test]
fn mistakes_name_field_problem_and_remedy() {
    insta::assert_snapshot!(refusals(&[
        r#"{"fault":{"kill":"glod"}}"#,
        r#"{"fault":{"kill":"executing:move-spil(top)"}}"#,
        r#"{"fault":{"restart":"executing:move-spill(top)"}}"#,
        r#"{"fault":{"move-robot":{"robot":"idle","x_m":1,"y_m":1}}}"#,
        r#"{"fault":{"add":"gold"}}"#,
        r#"{"fault":{"drop":{"p":1.5}}}"#,
        r#"{"fault":{"drop":{"to":"red","p":0.5}}}"#,
        r#"{"fault":{"drop":{"from":"blue","to":"blue","p":0.5}}}"#,
        r#"{"fault":{"sensor":{"robot":"blue","device":"hand","mode":{"noise":{"m":1}}}}}"#,
        r#"{"fault":{"sensor":{"robot":"gold","device":"side-border","mode":"dead"}}}"#,
        r#"{"fault":{"shake":{"x_m":13,"y_m":1}}}"#,
        r#"{"fault":{"shake":{"x_m":1,"y_m":1}},"for_s":3}"#,
        r#"{"fault":{"mute":"blue"},"every_s":3}"#,
        r#"{"fault":{"mute":"blue"},"every_s":3,"for_s":3}"#,
        r#"{"fault":{"mute":"blue"},"when":"gold naps"}"#,
        r#"{"fault":{"mute":"blue"},"when":"gold activates repor"}"#,
        r#"{"fault":{"mute":"blue"},"when":"gold dies","at_s":3}"#,
        r#"{"fault":{"obstacle":{"x_m":100,"y_m":-1,"width_m":50,"height_m":50}}}"#,
        r#"{"fault":{"obstacle":{"x_m":-1,"y_m":-1,"width_m":50,"height_m":50}}}"#,
        r#"{"fault":{"partition":{"groups":[["blue"],["gold","blue"]]}}}"#,
    ]));
}

#[test]
fn a_mode_without_or_with_a_needless_value_is_named() {
    let refusal = |mode: &str| {
        let text = format!(
            "[faults]\ntimeline = [{{ fault.actuator = {{ robot = 'gold', mode = {mode} }} }}]"
        );
        let read = Scenario::parse("s.toml", &text, &vocabulary());
        read.unwrap_err().to_string()
    };
    assert_eq!(
        refusal("'slowed'"),
        "s.toml:2: faults.timeline[0].fault.actuator.mode: the choice needs a value; write { CHOICE = VALUE }"
    );
    assert_eq!(
        refusal("{ dead = 1 }"),
        "s.toml:2: faults.timeline[0].fault.actuator.mode.dead: 1 does not fit; write the choice alone, as a string in quotes"
    );
}

#[test]
fn events_are_parsed_from_text() {
    for (text, robot, what, subject) in [
        (
            "blue activates move(top)",
            Some("blue"),
            "activates",
            Some("move(top)"),
        ),
        ("any  delivers", None, "delivers", None),
    ] {
        let when: EventTrigger = text.parse().unwrap();
        let parts = (when.robot.as_deref(), &*when.what, when.subject.as_deref());
        assert_eq!(parts, (robot, what, subject));
        assert_eq!(when.to_string(), text.replace("  ", " "));
    }
    let any: EventTrigger = "blue picks any".parse().unwrap();
    assert_eq!(any, "blue picks".parse().unwrap());
    for wrong in ["", "blue", "blue dies twice", "blue picks a b"] {
        assert!(wrong.parse::<EventTrigger>().is_err(), "{wrong}");
    }
}

#[test]
fn only_existing_skills_can_get_worse() {
    let mut scenario = default_scenario();
    scenario.robots[0].skills = Some([("lift".to_owned(), 0.0)].into());
    let orders = [
        ("gold", "lfit", 0.3),
        ("blue", "lift", 0.3),
        ("gold", "lift", -0.1),
        ("gold", "lift", 1.1),
        ("gold", "lift", f64::NAN),
    ];
    let refusals = orders.map(|(robot, skill, share)| {
        let fault = Fault::Skill(SkillFault {
            robot: robot.to_owned(),
            skill: skill.to_owned(),
            share,
        });
        let checked = Order::now(fault).check(&scenario, &Catalog::new(&scenario));
        let error = checked.unwrap_err().to_string();
        entry(&format!("{robot} {skill} {share}"), &error)
    });
    insta::assert_snapshot!(refusals.concat());
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
            let mut stated = values.keys();
            assert!(stated.all(|key| keys.contains(&key.as_str())), "{name}");
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

/// The run ends before its limit, and a repetition begins with a step.
#[test]
fn the_number_of_times_follows_from_limit_and_steps() {
    let times = |due_ms: Option<u64>, every_s: Option<f64>| {
        let order = Order {
            every_s,
            ..Order::now(Fault::Mute("blue".to_owned()))
        };
        order.times(due_ms.map(SimTime), 100.0, 50)
    };
    assert_eq!(times(None, None), 1);
    assert_eq!(times(Some(99_950), None), 1);
    assert_eq!(times(Some(99_951), None), 0);
    assert_eq!(times(Some(0), Some(50.0)), 2);
    assert_eq!(times(Some(0), Some(49.9)), 3);
    // Every 0.1 s instead of 0.07 s.
    assert_eq!(times(Some(99_000), Some(0.07)), 10);
}
