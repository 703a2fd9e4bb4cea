//! The command line accepts the text form of every fault.

use clap::{CommandFactory, Parser};
use scenario::testkit::{entry, one_of_each};

use super::*;

#[derive(Debug, Parser)]
struct Alone {
    #[command(flatten)]
    fault: FaultArgs,
}

/// Splits a line like a shell: at spaces outside double quotes.
fn words(line: &str) -> Vec<String> {
    let mut words = vec!["fault".to_owned()];
    for (index, part) in line.split('"').enumerate() {
        if index % 2 == 0 {
            words.extend(part.split_whitespace().map(str::to_owned));
        } else {
            words.push(part.to_owned());
        }
    }
    words
}

fn read(line: &str) -> Result<Order, String> {
    let alone = Alone::try_parse_from(words(line)).map_err(|error| error.to_string())?;
    match alone.fault.action {
        Some(Action::Order(order)) => order.into_order().map_err(|problem| problem.to_string()),
        other => panic!("{line}: {other:?}"),
    }
}

#[test]
fn the_command_definition_is_valid() {
    Alone::command().debug_assert();
}

#[test]
fn the_text_form_of_every_fault_is_a_command() {
    let timings = [
        "",
        " --at 60.5s --for 10s",
        " --at 0s --every 120s --for 0.001s",
        " --for 3s --when \"blue activates move-spill(top)\"",
        " --when \"any dies\"",
    ];
    // The declarations have an example of every common fault; "shake" belongs to a mission that this program lacks.
    let common = one_of_each().into_iter().map(Order::now);
    let common = common.filter(|order| order.fault.kind().is_some());
    let common: Vec<Order> = common.collect();
    assert!(common.len() > 20);
    for order in common {
        assert_eq!(read(&order.to_string()), Ok(order));
    }
    // Negative numbers, words as sizes, and a fault of a mission.
    for line in [
        "sensor gold position noise 0 --deg -0.1",
        "sensor gold waste bias -0.5",
        "actuator gold turn-bias -10.5",
        "actuator gold one-wheel right",
        "obstacle -2 -1.5 0.5 0.5 --penetrability 0.5",
        "move-waste --item 7 --x-m 3 --y-m 4.5",
        "move-robot gold 3 4 --heading -90",
    ] {
        for timing in timings {
            let line = format!("{line}{timing}");
            assert_eq!(read(&line).map(|order| order.to_string()), Ok(line));
        }
    }
}

#[test]
fn times_have_common_units() {
    for (text, for_s) in [
        ("60s", 60.0),
        ("60", 60.0),
        ("1.5s", 1.5),
        ("500ms", 0.5),
        ("2min", 120.0),
        ("0.5 min", 30.0),
        ("1e3s", 1000.0),
    ] {
        let order = read(&format!("mute gold --for \"{text}\"")).unwrap();
        assert_eq!(order.for_s, Some(for_s), "{text}");
    }
}

#[test]
fn short_forms_are_accepted() {
    for (short, long) in [
        ("drop --p 0.3", "drop --from all --to all --p 0.3"),
        ("poor-radio", "radio poor-radio"),
        ("good-radio --for 60", "radio good-radio --for 60s"),
        ("severe-radio", "radio severe-radio"),
        ("hold", "hold --from all --to all"),
        ("waste 3 4", "waste --items 1 --x-m 3 --y-m 4"),
        ("waste 3 4 5", "waste --items 5 --x-m 3 --y-m 4"),
        ("point 3 4", "point --x-m 3 --y-m 4"),
        ("point 3 4 t", "point --kind t --x-m 3 --y-m 4"),
        ("point 3 4 --kind 7", "point --kind 7 --x-m 3 --y-m 4"),
        ("partition blue,gold/green", "partition blue,gold / green"),
        (
            "partition \"blue, gold / green\"",
            "partition blue,gold / green",
        ),
        ("partition blue gold / green", "partition blue,gold / green"),
        ("kill gold --at 2min", "kill gold --at 120s"),
    ] {
        assert_eq!(read(short).unwrap().to_string(), long);
    }
    let order = read("kill gold --id first").unwrap();
    assert_eq!(order.id.as_deref(), Some("first"));
}

/// Returns the forms of `alliance fault` in the code of a document.
fn forms(document: &str) -> Vec<String> {
    let code = document.split('`').skip(1).step_by(2).flat_map(str::lines);
    let calls = code.filter_map(|line| {
        line.trim()
            .trim_start_matches("$ ")
            .strip_prefix("alliance fault ")
    });
    let calls = calls.filter(|call| !call.starts_with(['-', 'N']));
    calls
        .map(|call| call.split(" #").next().unwrap_or(call).trim().to_owned())
        .collect()
}

/// The documents show only commands that the program accepts, with and without their optional arguments.
#[test]
fn documented_forms_are_accepted() {
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let mut missions: Vec<_> = std::fs::read_dir(docs.join("missions")).unwrap().collect();
    missions.sort_by_key(|entry| entry.as_ref().unwrap().path());
    let missions = missions.into_iter().map(|entry| entry.unwrap().path());
    let mut checked = Vec::new();
    for path in missions.chain([docs.join("CONTROL.md"), docs.join("book/break.md")]) {
        for form in forms(&std::fs::read_to_string(&path).unwrap()) {
            let whole = form.replace(['[', ']'], "");
            let least = form.split(" [").next().unwrap_or(&form);
            for line in [&whole, least] {
                let line = line.replace(" X Y", " 3 4.5").replace("KIND", "dust");
                let line = line.replace(" ID", " f1");
                let parsed = Alone::try_parse_from(words(&line));
                assert!(
                    parsed.is_ok(),
                    "{}: {line}: {:?}",
                    path.display(),
                    parsed.err()
                );
                checked.push(line);
            }
        }
    }
    for expected in ["point 3 4.5 dust", "point 3 4.5", "skill gold dust 0.3"] {
        assert!(checked.iter().any(|line| line == expected), "{checked:?}");
    }
}

#[test]
fn mistakes_return_a_remedy() {
    let durations = ["s", "-3s", "1h30", "inf", "NaN", "1e999s", "5 parsecs"];
    let lines = [
        "kil gold",
        "kill",
        "sensor gold nose dead",
        "sensor gold waste late",
        "sensor gold waste noise",
        "sensor gold waste noise x",
        "sensor gold waste dead 3",
        "sensor gold waste dead --deg 3",
        "actuator gold slowed",
        "actuator gold one-wheel up",
        "radio bad-radio",
        "mute gold --when gold",
        "list --at 3",
    ]
    .map(str::to_owned);
    let lines = lines
        .into_iter()
        .chain(durations.map(|time| format!("mute gold \"--for={time}\"")));
    let answers = lines.map(|line| entry(&line, &read(&line).unwrap_err()));
    insta::assert_snapshot!(answers.collect::<String>());
}

#[test]
fn acknowledgements_contain_fault_and_time() {
    let acknowledged = |line: &str, tick: Option<u64>| {
        let armed = Armed {
            id: "f3".to_owned(),
            tick,
            t_ms: tick.map(|tick| SimTime(50 * tick)),
        };
        acknowledge(&armed, &read(line).unwrap())
    };
    let answers = [
        ("kill gold", Some(1234)),
        ("waste 3 4 --every 60s", Some(1234)),
        ("mute gold --when \"any dies\" --for 1.5s", None),
    ]
    .map(|(line, tick)| entry(line, &acknowledged(line, tick)));
    insta::assert_snapshot!(answers.concat());
}
