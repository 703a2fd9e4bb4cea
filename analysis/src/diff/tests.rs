//! Altered logs, and pairs of runs with a known first difference.

use std::collections::BTreeMap;

use missions::Registry;
use missions::waste::data::{WasteSection, default_scenario};
use run_log::{Document, Input, InputLine, MemoryLog};
use scenario::Scenario;
use scenario::fault::{Fault, Order};

use super::*;
use crate::testkit::{self, open};
use in_process::Team;

/// Returns the log of a short run in memory.
fn memory() -> MemoryLog {
    let scenario = Scenario {
        limit_s: 60.0,
        ..default_scenario()
    };
    let setup = testkit::setup(scenario);
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    team.run().unwrap().1.into_sink()
}

fn lines(memory: &MemoryLog, table: Table) -> Vec<String> {
    let text = str::from_utf8(&memory.tables[&table]).unwrap();
    text.lines().map(ToOwned::to_owned).collect()
}

fn set_lines(memory: &mut MemoryLog, table: Table, lines: &[String]) {
    memory
        .tables
        .insert(table, (lines.join("\n") + "\n").into_bytes());
}

/// Makes the seals of a table anew.
fn reseal(memory: &mut MemoryLog, table: Table) {
    let rows = lines(memory, table);
    let time = |row: &str| row.split(',').next().unwrap().parse::<u64>();
    let mut sealed = lines(memory, Table::Ticks);
    for row in &mut sealed {
        let Some((place, _)) = row.rsplit_once(',') else {
            continue;
        };
        if place.ends_with(table.file_name()) {
            let now = time(row).unwrap();
            let whole = rows
                .iter()
                .filter(|row| time(row).map_or(true, |at| at <= now));
            let whole: String = whole.map(|row| format!("{row}\n")).collect();
            let hash = xxhash_rust::xxh3::xxh3_64(whole.as_bytes());
            *row = format!("{place},{hash:016x}");
        }
    }
    set_lines(memory, Table::Ticks, &sealed);
}

/// A file from elsewhere can have a line of any length.
#[test]
fn a_difference_of_long_values_is_a_short_line() {
    let long = "x".repeat(3_000_000);
    let difference = Difference::at_end("run.json", Some(long.clone()), long, String::new());
    let shown = Comparison::Differs(difference).to_string();
    assert_eq!(shown.lines().count(), 1);
    assert!(shown.len() < 1000, "{} bytes", shown.len());
}

#[test]
fn programs_of_different_builds_are_named() {
    let memory = memory();
    let (mut a, mut b) = (open(&memory).run, open(&memory).run);
    for run in [&mut a, &mut b] {
        run.build = "0123456789abcdef".to_owned();
    }
    assert_eq!(program_difference(&a, &b), None);
    b.agent_builds = BTreeMap::from([("blue".to_owned(), "fedcba9876543210".to_owned())]);
    let agents = "build of the agent of blue: 0123456789abcdef in A, fedcba9876543210 in B";
    assert_eq!(program_difference(&a, &b).as_deref(), Some(agents));
    b.build = "0000000000000000".to_owned();
    let programs = "build of the program: 0123456789abcdef in A, 0000000000000000 in B";
    assert_eq!(program_difference(&a, &b).as_deref(), Some(programs));
    // A library's tests have no build.
    b.build.clear();
    for agents in [
        BTreeMap::new(),
        BTreeMap::from([("blue".to_owned(), a.build.clone())]),
    ] {
        b.agent_builds = agents;
        assert_eq!(program_difference(&a, &b), None);
    }
}

#[test]
fn a_changed_row_differs_with_remade_and_with_removed_seals() {
    let memory = memory();
    let again = open(&memory);
    let identical = compare_files(&open(&memory), &again).unwrap();
    assert!(
        matches!(identical, Comparison::Identical { .. }),
        "{identical}"
    );
    use Table::{Events, Mission, Motivations, Poses};
    for table in [Poses, Events, Mission, Motivations] {
        let mut untouched = memory.clone();
        reseal(&mut untouched, table);
        assert!(untouched == memory, "{table:?}: the test makes other seals");

        let mut altered = memory.clone();
        let mut rows = lines(&altered, table);
        let row = rows.len() / 2;
        let (start, _) = rows[row].rsplit_once(',').unwrap();
        rows[row] = format!("{start},7");
        set_lines(&mut altered, table, &rows);
        reseal(&mut altered, table);
        let log = open(&altered);
        assert_eq!((log.torn, &*log.excess), (None, &[][..]), "{table:?}");
        let text = compare_files(&log, &again).unwrap().to_string();
        let place = format!(" {}, ", table.file_name());
        assert!(
            text.starts_with("differs first in tick") && text.contains(&place),
            "{text}"
        );
        assert!(
            text.contains(&format!(" in line {}: '7' and ", row + 1)),
            "{text}"
        );

        let mut sealed = lines(&altered, Table::Ticks);
        sealed.retain(|row| !row.contains(table.file_name()));
        set_lines(&mut altered, Table::Ticks, &sealed);
        let log = open(&altered);
        assert_eq!(log.excess, [table]);
        let text = compare_files(&log, &again).unwrap().to_string();
        assert!(
            text.starts_with("differs") && text.contains(table.file_name()),
            "{text}"
        );
    }
    // A table that disagrees with its seals is named with its row.
    for table in [Poses, Events, Mission, Motivations] {
        let rows = lines(&memory, table);
        for row in [1, rows.len() / 2, rows.len() - 1] {
            for change in ["changed", "removed", "doubled"] {
                let mut altered_rows = rows.clone();
                match change {
                    "changed" => altered_rows[row] = rows[row].replace(',', ",0"),
                    "removed" => drop(altered_rows.remove(row)),
                    _ => altered_rows.insert(row, rows[row].clone()),
                }
                let first = (0..)
                    .find(|at| altered_rows.get(*at) != rows.get(*at))
                    .unwrap();
                let mut altered = memory.clone();
                set_lines(&mut altered, table, &altered_rows);
                let text = compare_files(&open(&altered), &again).unwrap().to_string();
                let place = format!(" {}, ", table.file_name());
                let line = format!(" in line {}: ", first + 1);
                assert!(
                    text.contains(&place) && text.contains(&line),
                    "{change}: {text}"
                );
            }
        }
    }
    let mut shorter = memory.clone();
    let mut seals = lines(&memory, Table::Ticks);
    let _ = seals.pop();
    let last = format!(
        " ticks.csv, t_ms in line {}: 'no row' and ",
        seals.len() + 1
    );
    set_lines(&mut shorter, Table::Ticks, &seals);
    let text = compare_files(&open(&shorter), &again).unwrap().to_string();
    assert!(text.contains(&last), "{text}");
    let mut altered = memory.clone();
    let mut inputs = lines(&memory, Table::Inputs);
    inputs[1] = inputs[1].replace("incarnation\":1", "incarnation\":2");
    set_lines(&mut altered, Table::Inputs, &inputs);
    assert_eq!(
        compare_files(&open(&altered), &again).unwrap().to_string(),
        "differs: world inputs.jsonl: 'rows that agree with their seals for 0 ticks only' and 'more'"
    );
    let mut longer = memory.clone();
    let inputs = longer.tables.get_mut(&Table::Inputs).unwrap();
    inputs.extend(b"{}\n");
    let line = lines(&memory, Table::Inputs).len() + 1;
    assert_eq!(
        compare_files(&open(&longer), &again).unwrap().to_string(),
        format!("differs: world inputs.jsonl, in line {line}: '{{}}' and 'no row'")
    );
}

#[test]
fn every_value_of_run_json_is_compared() {
    let memory = memory();
    let again = open(&memory);
    let text = &memory.documents[&run_log::Document::Run];
    let run: Value = serde_json::from_str(text).unwrap();
    let values = [
        ("/version", "9.9.9".into()),
        ("/unscripted", true.into()),
        ("/outcome", "complete".into()),
        ("/hash", "0000000000000000".into()),
        ("/result/items/delivered", 24.into()),
        ("/result/robots/gold/messages_sent", 0.into()),
        ("/result/sim_time_ms", 0.into()),
        ("/added", 1.into()),
        ("/result/added", 1.into()),
    ];
    for (pointer, value) in values {
        let mut altered = run.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        altered.pointer_mut(parent).unwrap()[key] = value;
        let mut memory = memory.clone();
        memory
            .documents
            .insert(run_log::Document::Run, altered.to_string());
        let text = compare_files(&open(&memory), &again).unwrap().to_string();
        let (_, line) = text.split_once("differs: ").unwrap_or_default();
        assert!(line.contains(key), "{pointer}: {text}");
    }
}

/// Appends the JSON pointers of all values that contain no others.
fn leaves(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(object) if !object.is_empty() => {
            for (key, value) in object {
                let key = key.replace('~', "~0").replace('/', "~1");
                leaves(value, &format!("{at}/{key}"), found);
            }
        }
        Value::Array(list) if !list.is_empty() => {
            for (index, value) in list.iter().enumerate() {
                leaves(value, &format!("{at}/{index}"), found);
            }
        }
        _ => found.push(at.to_owned()),
    }
}

/// A changed or removed value differs, or the reader refuses the file.
#[test]
fn no_value_of_run_json_changes_without_a_difference() {
    let scenario = Scenario {
        limit_s: 1.0,
        ..default_scenario()
    };
    let team = Team::new(
        testkit::setup(scenario),
        LogLevel::Full,
        MemoryLog::default(),
    );
    let memory = team.unwrap().run().unwrap().1.into_sink();
    let again = open(&memory);
    let run: Value = serde_json::from_str(&memory.documents[&Document::Run]).unwrap();
    let mut pointers = Vec::new();
    leaves(&run, "", &mut pointers);
    pointers.retain(|pointer| {
        let mut roots = NOT_REPRODUCED.iter();
        roots.all(|root| !pointer.starts_with(&format!("/{root}")))
    });
    let vocabulary = Registry::built_in().vocabulary();
    let mut differences = 0;
    let mut alter = |what: &str, altered: &Value| {
        let mut memory = memory.clone();
        memory.documents.insert(Document::Run, altered.to_string());
        let Ok(log) = RunLog::from_memory(&memory, &vocabulary) else {
            return;
        };
        if let Ok(compared) = compare_files(&log, &again) {
            assert!(
                matches!(compared, Comparison::Differs(_)),
                "{what}: {compared}"
            );
            differences += 1;
        }
    };
    for pointer in &pointers {
        let mut altered = run.clone();
        let value = altered.pointer_mut(pointer).unwrap();
        *value = match value {
            Value::Bool(flag) => (!*flag).into(),
            Value::Number(number) if number.as_f64() == Some(0.0) => 1.into(),
            Value::Number(_) => 0.into(),
            Value::String(text) => format!("{text}x").into(),
            _ => 1.into(),
        };
        alter(pointer, &altered);
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let mut altered = run.clone();
        // An absent value has the meaning of null.
        if let Some(Value::Object(object)) = altered.pointer_mut(parent)
            && object.remove(key).is_some_and(|value| !value.is_null())
        {
            alter(&format!("without {pointer}"), &altered);
        }
    }
    assert!(pointers.len() > 100, "{} values", pointers.len());
    assert!(differences > 50, "{differences} differences");
}

/// Runs the scenario for a short time, optionally with an operator's order.
fn run(seed: u64, change: impl FnOnce(&mut Scenario), order: Option<InputLine>) -> RunLog {
    // Long enough for random draws to have an effect.
    let mut scenario = Scenario {
        limit_s: 80.0,
        ..default_scenario()
    };
    change(&mut scenario);
    let mut setup = testkit::setup(scenario);
    setup.seed = seed;
    testkit::run_with(setup, order.into_iter().collect())
}

#[track_caller]
fn check(a: &RunLog, b: &RunLog, cause: &str, second: &str) {
    let text = compare(a, b).unwrap().to_string();
    let (first, rest) = text.split_once('\n').unwrap_or((&text, ""));
    assert_eq!(first, cause, "{text}");
    assert!(rest.starts_with(second), "{text}");
}

#[test]
fn seeds_and_scenarios_come_first() {
    let first = run(1, |_| {}, None);
    let place = "differs first in tick";
    let other = run(2, |_| {}, None);
    check(&first, &other, "seed: 1 in A, 2 in B", place);
    let hurry = |scenario: &mut Scenario| WasteSection::of_mut(scenario).report_period_s = 60.0;
    let cause = "scenario: waste.report_period_s: 120.0 in A, 60.0 in B";
    check(&first, &run(1, hurry, None), cause, place);
}

#[test]
fn an_input_of_one_run_is_reported_in_either_order() {
    let order = InputLine {
        tick: 100,
        input: Input::Order {
            order: Order {
                id: Some("f1".to_owned()),
                ..Order::now(Fault::Mute("gold".to_owned()))
            },
            moment: None,
        },
    };
    let (calm, broken) = (run(1, |_| {}, None), run(1, |_| {}, Some(order)));
    let place = "differs first in tick 100 (5.000 s): world inputs";
    let cause = "inputs: 'mute gold' was ordered at 5 s in";
    check(&calm, &broken, &format!("{cause} B"), place);
    check(&broken, &calm, &format!("{cause} A"), place);
}
